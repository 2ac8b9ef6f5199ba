// SPDX-License-Identifier: BSD-3-Clause
// A run that is still going on, fetched from the server that the page came from.
import {readBlock} from './blocks.js';
import {element} from './panel.js';

const kWait = 150;  // milliseconds between questions
const kLargeAnswer = 1 << 20;  // bytes: the server sends the rest when asked again

export function follow() {
  const ask = (path, method = 'GET') => fetch(path, {method});
  const status = {state: 'running'};
  let player;

  async function* blocks() {
    for (let k = 0;;) {
      let answer;
      try {
        answer = await ask(`blocks/${k}`);
      } catch {
        status.state = 'gone';
        player?.notify();
        return;
      }
      const state = answer.headers.get('X-Dyop-State') ?? status.state;
      if (answer.status === 200) {
        const bytes = new Uint8Array(await answer.arrayBuffer());
        const view = new DataView(bytes.buffer);
        for (let at = 0; at < bytes.length; ++k) {
          const length = view.getUint32(at, true);
          yield readBlock(bytes.subarray(at + 4, at + 4 + length));
          at += 4 + length;
        }
        if (bytes.length >= kLargeAnswer) continue;  // there may be more
      } else {
        // Only now does the page have all that came before.
        status.state = state;
        player?.notify();
        if (state === 'finished') return;
      }
      if (state === 'running') status.state = state, player?.notify();
      await new Promise((done) => setTimeout(done, kWait));
    }
  }

  function addTo(thePlayer) {
    player = thePlayer;
    player.isLive = player.timeline.live = player.follows = true;
    const words = element('span', {class: 'dim', role: 'status', id: 'live-state'});
    const pause = element('button', {id: 'live-pause', title: 'Pause the simulation itself', onclick: async () => {
      const pauses = status.state === 'running';
      await ask(pauses ? 'pause' : 'resume', 'POST');
      status.state = pauses ? 'pausing' : 'running';
      player.notify();
    }});
    const stop = element('button', {id: 'live-stop', title: 'End the simulation with what is proven', onclick: async () => {
      await ask('stop', 'POST');
    }}, 'Stop run');
    const latest = element('button', {title: 'Follow the run (End)', onclick: () => {
      player.follows = true;
      player.isPlaying = false;
      player.grown();
    }}, 'Follow');
    document.querySelector('#transport .buttons').append(latest, pause, stop, words);
    document.getElementById('busy').hidden = true;
    player.changed.add(() => {
      words.textContent = {running: 'running', pausing: 'pausing', paused: 'paused', finished: 'finished',
                           gone: 'the run has ended'}[status.state];
      pause.textContent = status.state === 'running' ? 'Pause run' : 'Resume run';
      pause.disabled = stop.disabled = status.state === 'finished' || status.state === 'gone';
      latest.setAttribute('aria-pressed', String(Boolean(player.follows)));
      player.isFinished = pause.disabled;
    });
  }

  return {blocks, addTo};
}
