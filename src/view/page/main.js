// SPDX-License-Identifier: BSD-3-Clause
// Reads the run, block by block, and shows it as soon as its first bodies are there.
import {bytesFromBase64, readBlock} from './blocks.js';
import {addControls, readLink} from './controls.js';
import {follow} from './live.js';
import {newState} from './motion.js';
import {Player} from './player.js';
import {Run} from './run.js';

// Milliseconds of reading between two pictures. Of a run that is over each time is twice the last one,
// so that pictures hardly delay the reading.
const kReadingTurn = 200;

const byId = (id) => document.getElementById(id);

function complain(text) {
  const notice = byId('notice');
  notice.textContent = text;
  notice.hidden = false;
  byId('busy').hidden = true;
}

function hasWebGL() {
  try {
    return Boolean(document.createElement('canvas').getContext('webgl2'));
  } catch {
    return false;
  }
}

function preferredTheme() {
  return matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light';
}

function nextTask() {
  return new Promise((done) => setTimeout(done, 0));
}

// The blocks in the page, while the rest of it is still being read.
async function* blocksOfPage() {
  for (;;) {
    const isWhole = document.readyState !== 'loading';
    const script = document.querySelector('script.block');
    if (script && (isWhole || script.nextElementSibling)) {
      const text = script.textContent;
      script.remove();
      yield readBlock(bytesFromBase64(text));
    } else if (isWhole) {
      return;
    } else {
      await new Promise((done) => setTimeout(done, 5));
    }
  }
}

function startPlayer(run) {
  const player = new Player(run);
  player.setTheme = (theme) => {
    document.documentElement.dataset.theme = theme;
    player.stage.setTheme(theme);
    player.compare?.setTheme(theme);
    player.curves.stale = true;
    player.notify();
  };
  player.onResize = () => {
    player.stage.resize();
    player.compare?.resize();
    player.curves.stale = true;
    player.redraw();
  };
  if (window.innerWidth <= 900) byId('panel').hidden = true;
  player.setTheme(preferredTheme());
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => player.setTheme(preferredTheme()));
  new ResizeObserver(() => player.onResize()).observe(byId('view'));
  addControls(player);
  player.stage.resize();
  return player;
}

// What the checker said of the recording; all of it under the pointer.
function showBadge({proven, words}) {
  const badge = byId('badge');
  badge.hidden = false;
  badge.className = proven ? 'proven' : 'unproven';
  badge.title = words;
  badge.textContent = proven ? `✓ proven by dyop-check: ${words.split(':')[0]}` : `✗ not proven by dyop-check: ${words.split(':')[0]}`;
}

// A run that is over quickly, or takes long, is played in some ten seconds.
function pleasantSpeed(span) {
  const wanted = span / 10;
  const speeds = [1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.05, 0.1, 0.25, 0.5, 1];
  return span >= 1 && span <= 60 ? 1 : speeds.find((s) => s >= wanted) ?? Math.round(wanted);
}

// A second block of a scene begins a second run.
async function readAll(player, run, blocks) {
  let waiting;
  let other;
  let turn = kReadingTurn;
  for await (const block of blocks) {
    if (block.block === 'scene') {
      other = new Run(block);
      continue;
    }
    (other ?? run).append(block);
    if (block.block === 'chunk') continue;  // changes no picture until its time is looked at
    waiting ??= setTimeout(() => {
      waiting = undefined;
      if (!player.isLive) turn *= 2;
      player.grown();
    }, turn);
  }
  clearTimeout(waiting);
  player.grown();
  if (other) player.compareWith(other);
}

// What tests ask the page.
function hookFor(player, run) {
  return {
    run,
    player,
    state: (number, t) => run.stateInto(run.bodies[number], t, newState()),
    states: (queries) => queries.map(([number, t]) => run.stateInto(run.bodies[number], t, newState())),
    project: (point) => player.stage.project(point),
    draw: (isFinal) => player.draw(performance.now(), isFinal),
    show: (t) => player.show(t),
  };
}

async function main() {
  byId('title').textContent = document.title;
  if (!hasWebGL()) {
    complain('This page draws with WebGL 2, which this browser does not offer or has switched off. ' +
             'Try another browser, or allow hardware or software rendering in its settings.');
    return;
  }
  // What the page shows comes after this script.
  while (document.readyState === 'loading' && !document.querySelector('#live, script.block')) {
    await nextTask();
  }
  const live = document.querySelector('#live');
  const source = live ? follow() : undefined;
  const blocks = source ? source.blocks() : blocksOfPage();
  const head = (await blocks.next()).value;
  if (!head) {
    complain('This page holds no run.');
    return;
  }
  const run = new Run(head);
  byId('title').textContent = run.title;
  const first = await blocks.next();
  if (!first.done) run.append(first.value);
  if (run.check) showBadge(run.check);
  const player = startPlayer(run);
  player.speed = pleasantSpeed(run.plannedEnd - run.begin);
  player.stage.frame();
  source?.addTo(player);
  readLink(player);
  player.notify();
  player.draw();
  window.dyop = hookFor(player, run);
  window.dyop.firstPicture = performance.now();
  await readAll(player, run, blocks);
  if (!new URLSearchParams(location.hash.slice(1)).has('cam')) player.stage.frame();
  readLink(player);
  byId('busy').hidden = true;
  player.notify();
  player.draw();
  window.dyop.isReady = true;
}

main().catch((error) => {
  console.error(error);
  complain(`The run cannot be shown: ${error.message}`);
});
