// SPDX-License-Identifier: BSD-3-Clause
// A run that is still going on, fetched from the server that the page came from.
import {readBlock} from './blocks.js';
import {element} from './element.js';

const kWait = 150;  // milliseconds between questions
const kShortWait = 50;  // the same, of a run that keeps to the clock
const kLargeAnswer = 1 << 20;  // bytes: the server sends the rest when asked again
const kPaused = 'The run is paused';
const kMostFailures = 5;  // of questions in a row; then the run has ended

const sleep = (milliseconds) => new Promise((done) => setTimeout(done, milliseconds));

export function follow() {
  const status = {state: 'running'};
  let player;
  const wait = () => (player?.run.keepsTime ? kShortWait : kWait);
  let order = Promise.resolve();  // the last one given to the run, until the server has it

  function become(state) {
    if (status.state === state) return;
    status.state = state;
    player?.notify();
  }

  // Pause, resume or stop; what was asked before says nothing of the state after it.
  function command(word, state) {
    become(state);
    order = fetch(word, {method: 'POST'}).catch(() => {});  // the next question finds out
  }

  // The status, the state and the bytes of the blocks from k on; nothing once the run has ended.
  async function blocksFrom(k) {
    for (let failures = 0; failures < kMostFailures; ++failures, await sleep(wait())) {
      try {
        const answer = await fetch(`blocks/${k}`);
        const bytes = new Uint8Array(await answer.arrayBuffer());
        if (!answer.ok) continue;
        return {bytes, state: answer.headers.get('X-Dyop-State')};
      } catch {
        // The network may come back.
      }
    }
  }

  async function* blocks() {
    for (let k = 0;;) {
      const orderBefore = order;
      await orderBefore;
      const answer = await blocksFrom(k);
      if (!answer) return become('gone');
      const {bytes, state} = answer;
      const view = new DataView(bytes.buffer);
      for (let at = 0; at < bytes.length; ++k) {
        const length = view.getUint32(at, true);
        yield readBlock(bytes.subarray(at + 4, at + 4 + length));
        at += 4 + length;
      }
      // A run stands still only when the page has all that came before.
      if (order === orderBefore && (state === 'running' || bytes.length === 0)) become(state);
      if (bytes.length === 0 && state === 'finished') return;
      if (bytes.length < kLargeAnswer) await sleep(wait());
    }
  }

  function addTo(thePlayer) {
    player = thePlayer;
    player.isLive = player.timeline.live = player.follows = true;
    const words = element('span', {class: 'dim', role: 'status', id: 'live-state'});
    const pause = element('button', {id: 'live-pause', title: 'Pause the simulation itself', onclick: () => {
      if (status.state === 'running') command('pause', 'pausing');
      else command('resume', 'running');
    }});
    const stop = element('button', {id: 'live-stop', title: 'End the simulation with what is proven', onclick: () => {
      command('stop', 'running');
    }}, 'Stop run');
    const latest = element('button', {title: 'Follow the run (End)', onclick: () => {
      player.follows = true;
      player.isPlaying = false;
      player.grown();
    }}, 'Follow');
    pause.hidden = player.run.keepsTime;
    document.querySelector('#transport .buttons').append(latest, pause, stop, words);
    document.getElementById('busy').hidden = true;
    player.changed.add(() => {
      const running = player.run.keepsTime && !player.follows ? 'running; this picture is held' : 'running';
      const {ending} = player.run;
      words.textContent = ending ? `ended: ${ending}` : {running, pausing: 'pausing', paused: 'paused', finished: 'finished', gone: 'the run has ended'}[status.state];
      const busy = document.getElementById('busy');
      const isPaused = status.state === 'paused' || status.state === 'pausing';
      if (isPaused) busy.textContent = `${kPaused} at t = ${Number(player.run.end.toPrecision(6))}; Resume run goes on`;
      if (isPaused || busy.textContent.startsWith(kPaused)) busy.hidden = !isPaused;
      pause.textContent = status.state === 'running' ? 'Pause run' : 'Resume run';
      pause.disabled = stop.disabled = Boolean(ending) || status.state === 'finished' || status.state === 'gone';
      latest.setAttribute('aria-pressed', String(Boolean(player.follows)));
      player.isFinished = pause.disabled;
    });
  }

  return {blocks, addTo};
}
