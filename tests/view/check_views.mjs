// SPDX-License-Identifier: BSD-3-Clause
// Checks pages in headless Chromium, in ways that check_page.mjs does not:
//   large     the page of a run in chunks against that of the same run held whole, up to rounding
//   compare   two runs side by side against how far apart the library says their bodies are
//   close_up  the width of a gap in pixels of the picture
// Usage: DYOP_PAGE_MODULES=... node check_views.mjs CHROMIUM KIND FACTS.json PAGE.html...
// Exit code 0 if every check passes; each failure is one line.
import fs from 'node:fs';
import {pathToFileURL} from 'node:url';
import {kLongest, launch} from './browser.mjs';

const [chromium, kind, factsFile, ...files] = process.argv.slice(2);
const facts = JSON.parse(fs.readFileSync(factsFile, 'utf8'));

let failures = 0;
function check(holds, words) {
  if (holds) return;
  ++failures;
  console.log(`FAILED: ${words}`);
}

const browser = await launch(chromium, {smoothsEdges: kind === 'close_up'});

async function open(file, {width = 600, height = 380} = {}) {
  const page = await browser.newPage();
  await page.setViewport({width, height});
  page.on('console', (message) => check(message.type() !== 'error', `the console says ${message.text()}`));
  page.on('pageerror', (error) => check(false, `error in the page: ${error.message}`));
  await page.goto(pathToFileURL(file).href);
  await page.waitForFunction('window.dyop && window.dyop.isReady', {timeout: kLongest});
  return page;
}

const settled = (page) =>
  page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

// All that a page says of a time, and its picture.
const allOf = (page, t) => page.evaluate(async (at) => {
  const {run, player, show} = window.dyop;
  await show(at);
  const state = run.bodies.map((body) => {
    const {p, q, v, w} = run.state(body, at);
    const orientation = q.flatMap((x, k) => q.slice(k).map((y) => x * y));  // whatever the sign of q
    return [run.isPresent(body, at) ? 1 : 0, ...p, ...orientation, ...v, ...w];
  });
  const name = ({a, b, begin, t: time}) => `${a} ${b} ${begin ?? time}`;
  const plain = (rows) => rows.map((row) => [name(row), ...Object.values(row).flat().map((x) => (typeof x === 'number' ? x : x ? 1 : 0))])
    .sort((a, b) => (a[0] < b[0] ? -1 : a[0] > b[0] ? 1 : 0));
  const sorted = (rows) => plain(rows.map((row) => Object.fromEntries(Object.entries(row).sort(([a], [b]) => (a < b ? -1 : 1)))));
  const copy = document.createElement('canvas');
  [copy.width, copy.height] = [225, 140];
  const pen = copy.getContext('2d');
  pen.drawImage(player.stage.canvas, 0, 0, copy.width, copy.height);
  const bounds = ({t: time, a, b, lower, upper, resting, proof}) => ({t: time, a, b, lower, upper, resting, proof});
  const nearest = run.nearestGap(at);
  return {state, contacts: sorted(run.contactsAt(at)), gaps: sorted(run.gapsAt(at).map(bounds)), nearest: sorted(nearest ? [nearest] : []),
          islands: [run.islandsAt(at)],
          picture: [[...pen.getImageData(0, 0, copy.width, copy.height).data]]};
}, t);

// What chunks round is the same up to parts of 1, of impulses of the largest one. Of gaps they keep the
// place of the nearest only.
const kRounding = {state: 1e-5, contacts: 1e-3, gaps: 1e-3, nearest: 1e-3, islands: 0};
const kPixels = 0.5;  // levels of colour, on average: edges of bodies may be drawn a pixel away
function differ(name, a, b) {
  if (name === 'picture') {
    const mean = a[0].reduce((sum, x, k) => sum + Math.abs(x - b[0][k]), 0) / a[0].length;
    return mean < kPixels ? undefined : `${mean} levels`;
  }
  if (a.length !== b.length) return `${a.length} and ${b.length} rows`;
  const size = ['contacts', 'gaps', 'nearest'].includes(name) ? Math.max(1, ...a.flat().filter(Number.isFinite).map(Math.abs)) : 1;
  for (let row = 0; row < a.length; ++row) {
    for (let k = 0; k < a[row].length; ++k) {
      const [x, y] = [a[row][k], b[row]?.[k]];
      if (x === y || (x === null && y === null) || Math.abs(x - y) <= kRounding[name] * size) continue;
      return `row ${row}, column ${k}: ${x} and ${y}`;
    }
  }
  return undefined;
}

async function checkLarge() {
  const [whole, large] = [await open(files[0]), await open(files[1])];
  const chunks = await large.evaluate(() => window.dyop.run.chunks.map(({begin, end}) => [begin, end]));
  check(chunks.length >= 5, `only ${chunks.length} chunks`);
  chunks.forEach(([begin], k) => check(k === 0 || begin === chunks[k - 1][1], `chunk ${k} begins at ${begin}`));
  check(await whole.evaluate(() => window.dyop.run.chunks.length === 0), 'an ordinary run is in chunks');
  // Both look from the same place.
  const camera = await whole.evaluate(() => {
    const {camera: eye, controls} = window.dyop.player.stage;
    return [...eye.position.toArray(), ...controls.target.toArray()].join(',');
  });
  for (const page of [whole, large]) await page.evaluate((cam) => (location.hash = `cam=${cam}`), camera);
  // The same light, and no grid: a large run is framed from its outlines, which differ by a little.
  const light = await whole.evaluate(() => {
    const {size, center, sunward} = window.dyop.player.stage;
    return {size, center: center.toArray(), sunward: sunward.toArray()};
  });
  await large.evaluate(({size, center, sunward}) => {
    const {stage} = window.dyop.player;
    stage.size = size;
    stage.center.fromArray(center);
    stage.sunward.fromArray(sunward);
  }, light);
  for (const page of [whole, large]) await page.evaluate(() => (window.dyop.player.stage.ground.isShown = false));
  const times = [...facts.poses.slice(0, 20).map(({t}) => t), ...chunks.slice(0, 4).map(([begin]) => begin),
                 ...facts.impacts.slice(0, 6).map(({t}) => t), facts.end];
  // To and fro, so that chunks are dropped and read again.
  for (const t of times) {
    const [a, b] = [await allOf(whole, t), await allOf(large, t)];
    for (const name of Object.keys(a)) {
      const words = differ(name, a[name], b[name]);
      check(!words, `${name} differ at t = ${t}: ${words}`);
    }
  }
  const kept = await large.evaluate(() => window.dyop.run.chunks.filter(({store}) => store).length);
  check(kept <= 6, `${kept} chunks are kept`);
  const lists = (page) => page.evaluate(async () => {
    const {run, player} = window.dyop;
    const body = run.movers[0];
    await player.curves.add('z', body, body);
    await player.curves.add('force', body, body);
    document.querySelector('[data-tab=curves]').click();
    player.draw();
    const [force, z] = player.curves.plots.map(({data}) => data);
    return {end: run.end, ending: run.ending, steps: run.steps.rows.length, frames: run.frames.rows.length,
            impacts: run.impacts.rows.length, marks: run.marks.length,
            touches: run.touches.map(({t, a, b}) => `${t} ${a} ${b}`), z, force};
  });
  const [a, b] = [await lists(whole), await lists(large)];
  const isSame = (x, y) => (Array.isArray(x) && typeof x[0] === 'object' ? !x.some((list, k) => differ('contacts', [list], [y[k]]))
    : JSON.stringify(x) === JSON.stringify(y));
  for (const name of Object.keys(a)) {
    check(isSame(a[name], b[name]), `${name}: ${JSON.stringify(a[name])?.slice(0, 200)}, ${JSON.stringify(b[name])?.slice(0, 200)}`);
  }
  check(a.ending === 'it reached its planned end', `the run ended because '${a.ending}'`);
  await checkCoarse(large);
  // While a time is read the picture waits, and playing goes on by itself.
  await large.evaluate(() => window.dyop.player.seek(window.dyop.run.begin));
  await large.keyboard.press('Escape');
  await large.evaluate(() => {
    window.dyop.player.speed = 4;
    window.dyop.player.play(true);
  });
  await large.waitForFunction('!window.dyop.player.isPlaying', {timeout: kLongest});
  check(await large.evaluate(() => window.dyop.player.t === window.dyop.run.end), 'a run in chunks plays to its end');
}

// A large run is drawn coarsely, with few arrows, while time moves, and finely once it stands still.
async function checkCoarse(page) {
  const [coarse, fine] = await page.evaluate(async () => {
    const {run, player, show, draw} = window.dyop;
    const {stage, overlays} = player;
    stage.isFine = false;
    overlays.mostContacts = {still: 3, moving: 1};
    await show(run.begin);
    await show(run.end);
    const size = ({impulse}) => Math.hypot(...impulse);
    const all = run.contactsAt(run.end).map(size).sort((a, b) => b - a);
    const seen = () => ({width: stage.canvas.width, shadows: stage.sun.castShadow, legend: document.getElementById('legend').textContent,
                         arrows: overlays.normals.list.length, hasStrongest: Math.max(...overlays.drawnContacts.map(size)) === all[0], all: all.length});
    const first = seen();
    draw(true);
    return [first, seen()];
  });
  check(coarse.all > 3, `only ${coarse.all} contacts at the end`);
  check(coarse.arrows === 1 && fine.arrows === 3, `${coarse.arrows} arrows while time moves, ${fine.arrows} at rest`);
  check(coarse.hasStrongest && fine.hasStrongest, 'the strongest contact is drawn');
  check(coarse.legend.includes(`the strongest of ${coarse.all}`) && fine.legend.includes(`3 strongest of ${fine.all}`), `the legend says ${fine.legend}`);
  check(!coarse.shadows && fine.shadows && coarse.width < 0.7 * fine.width, `pictures of ${coarse.width} and ${fine.width} pixels`);
  // By itself, too.
  await page.evaluate(() => window.dyop.show(window.dyop.run.begin));
  await page.waitForFunction((width) => window.dyop.player.stage.canvas.width === width, {timeout: kLongest}, fine.width);
  await page.evaluate(() => (window.dyop.player.stage.isFine = true));
}

async function checkCompare() {
  const page = await open(files[0], {width: 1000});
  const found = await page.evaluate((times) => {
    const {player} = window.dyop;
    return times.map((t) => {
      player.seek(t);
      player.draw();
      return player.compare.largest.distance;
    });
  }, facts.differences.map(({t}) => t));
  facts.differences.forEach(({t, distance}, k) =>
    check(Math.abs(found[k] - distance) <= 1e-9 * (1 + distance), `at t = ${t} bodies are ${found[k]} apart, not ${distance}`));
  check(facts.differences.some(({distance}) => distance > 1e-3), 'the runs are too much alike');
  const curve = await page.evaluate(() => {
    document.querySelector('[data-tab=curves]').click();
    window.dyop.player.draw();
    return {title: document.querySelector('#tab-curves h2').textContent, data: window.dyop.player.curves.plots[0].data};
  });
  check(curve.title.startsWith('Difference of the two runs'), `the first curve is ${curve.title}`);
  const most = Math.max(...curve.data[1].filter((x) => x !== null));
  check(most >= 0.5 * Math.max(...facts.differences.map(({distance}) => distance)), `the curve of differences ends at ${most}`);
  // Dragging the second picture turns both cameras alike.
  const cameras = () => page.evaluate(() => [window.dyop.player.stage, window.dyop.player.compare.stage].map(({camera}) =>
    [...camera.position.toArray(), ...camera.quaternion.toArray()]));
  const before = await cameras();
  const box = await (await page.$('#stage-two')).boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + 0.3 * box.height);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width / 2 + 80, box.y + 0.3 * box.height + 20, {steps: 4});
  await page.mouse.up();
  await settled(page);
  const after = await cameras();
  const apart = (a, b) => Math.hypot(...a.map((x, k) => x - b[k]));
  check(apart(before[0], after[0]) > 0.01, 'dragging the second picture leaves the first');
  check(apart(after[0], after[1]) < 1e-9 * Math.hypot(...after[0]) + 1e-9, `the cameras are ${apart(after[0], after[1])} apart`);
  // Both pictures show bodies, in the same colours.
  const shown = await page.evaluate(() => {
    window.dyop.player.overlays.show = window.dyop.player.compare.overlays.show = {};
    window.dyop.player.draw();
    return ['stage', 'stage-two'].map((id) => {
      const canvas = document.getElementById(id);
      const copy = document.createElement('canvas');
      [copy.width, copy.height] = [canvas.width, canvas.height];
      const pen = copy.getContext('2d');
      pen.drawImage(canvas, 0, 0);
      const {data} = pen.getImageData(0, 0, copy.width, copy.height);
      const colors = new Map();
      for (let k = 0; k < data.length; k += 4) {
        const key = `${data[k] >> 5} ${data[k + 1] >> 5} ${data[k + 2] >> 5}`;
        colors.set(key, (colors.get(key) ?? 0) + 1);
      }
      return [copy.width, copy.height, ...[...colors].filter(([, count]) => count > 200).map(([key]) => key)];
    });
  });
  check(shown[0][0] === shown[1][0] && shown[0][1] === shown[1][1], `pictures of ${shown[0].slice(0, 2)} and ${shown[1].slice(0, 2)} pixels`);
  check(shown.every((list) => list.length > 4), `only ${shown.map((list) => list.length - 2)} colours are seen`);
  // A run beside itself.
  const same = await open(files[1], {width: 1000});
  const words = await same.evaluate(() => {
    window.dyop.player.seek(window.dyop.run.end / 2);
    window.dyop.player.draw();
    return document.getElementById('difference').textContent;
  });
  check(words === 'all poses are the same', `a run beside itself: ${words}`);
}

// The width of the gap along the line of the nearest points, in the picture and as it should be.
async function checkCloseUp() {
  const page = await open(files[0], {width: 900, height: 560});
  for (const {t, gap} of facts.gaps) {
    const {seen, expected} = await page.evaluate((at) => {
      const {player, project} = window.dyop;
      player.overlays.show = {witness: true};
      player.stage.ground.isShown = false;
      player.seek(at);
      player.draw();
      player.closeUp();
      player.draw();
      const {pa, pb} = player.overlays.shown;
      const ends = [pa, pb].map(project);
      player.overlays.show = {witness: false};
      player.overlays.update = () => {};
      player.overlays.pivot.visible = player.overlays.witness.lines.visible = false;
      player.label.hidden = true;
      player.stage.render(true);
      const canvas = player.stage.canvas;
      const copy = document.createElement('canvas');
      [copy.width, copy.height] = [canvas.width, canvas.height];
      const pen = copy.getContext('2d');
      pen.drawImage(canvas, 0, 0);
      delete player.overlays.update;
      const background = pen.getImageData(0, 0, copy.width, copy.height).data;
      const ground = player.stage.scene.background.getStyle().match(/\d+/g).map(Number);
      const isGround = (x, y) => [0, 1, 2].every((k) => Math.abs(background[4 * (Math.round(y) * copy.width + Math.round(x)) + k] - ground[k]) < 6);
      const [a, b] = ends;
      const length = Math.hypot(b.x - a.x, b.y - a.y);
      let count = 0;
      for (let s = -60; s <= length + 60; s += 0.25) {
        count += isGround(a.x + ((b.x - a.x) * s) / length, a.y + ((b.y - a.y) * s) / length) ? 0.25 : 0;
      }
      return {seen: count, expected: length};
    }, t);
    check(expected > 20, `a gap of ${gap} is ${expected} pixels wide`);
    check(Math.abs(seen - expected) < 2.5, `a gap of ${gap} takes ${seen} pixels of the picture, not ${expected}`);
  }
  // To another time, and close up before that was drawn.
  const far = await page.evaluate((t) => {
    const {player} = window.dyop;
    player.overlays.show = {witness: true};
    player.seek(player.run.begin);
    player.draw();
    player.seek(t);
    player.closeUp();
    const {pa, pb} = player.overlays.shown;
    const {x, y, z} = player.stage.controls.target;
    return Math.hypot(...[x, y, z].map((at, k) => at - (pa[k] + pb[k]) / 2));
  }, facts.gaps.at(-1).t);
  check(far < 1e-9, `close up goes ${far} beside the gap of a time that was not drawn`);
}

try {
  await {large: checkLarge, compare: checkCompare, close_up: checkCloseUp}[kind]();
} finally {
  await browser.close();
}
process.exit(failures === 0 ? 0 : 1);
