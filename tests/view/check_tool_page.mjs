// SPDX-License-Identifier: BSD-3-Clause
// Checks pages of a tool's runs in headless Chromium against facts of the runs.
// Usage: DYOP_PAGE_MODULES=... node check_tool_page.mjs CHROMIUM (PAGE.html FACTS.json)...
// Exit code 0 if every check passes; each failure is one line.
import fs from 'node:fs';
import {pathToFileURL} from 'node:url';
import {kLongest, launch} from './browser.mjs';

const [chromium, ...files] = process.argv.slice(2);

let failures = 0;
let current = '';
function check(holds, words) {
  if (holds) return;
  ++failures;
  console.log(`FAILED: ${current}: ${words}`);
}

const off = (a, b) => Math.hypot(...a.map((x, k) => x - b[k]));

const browser = await launch(chromium);

async function checkPage(file, facts) {
  const page = await browser.newPage();
  await page.setViewport({width: 500, height: 320});
  page.setDefaultTimeout(kLongest);
  page.on('pageerror', (error) => check(false, `error in the page: ${error.message}`));
  await page.goto(pathToFileURL(file).href);
  await page.waitForFunction('window.dyop && window.dyop.isReady', {timeout: kLongest});
  const run = await page.evaluate(() => ({
    end: window.dyop.run.end,
    samples: window.dyop.run.samples.rows.length,
    gaps: window.dyop.run.gaps.rows.length,
    ghosts: window.dyop.run.bodies.filter(({ghost}) => ghost).length,
  }));
  check(Math.abs(run.end - facts.end) < 1e-9, `the run ends at ${run.end}, not ${facts.end}`);
  check(run.samples >= (facts.samples ?? 100), `${run.samples} samples`);
  check(run.gaps === (facts.gaps ?? 2) * run.samples, `${run.gaps} gaps at ${run.samples} samples`);
  check(run.ghosts === facts.ghosts, `${run.ghosts} see-through bodies`);
  const badge = await page.evaluate(() => document.getElementById('badge').textContent);
  check(badge.slice(2) === (facts.badge ?? ''), `the badge says "${badge}"`);
  const axis = await page.evaluate(() => {
    const {player, run: all} = window.dyop;
    player.draw();
    const canvas = document.getElementById('timeline');
    // Marks are triangles in the upper part of the canvas, below which the bar begins.
    const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, 14);
    const isPainted = (x) => Array.from({length: 14}, (_, y) => data[4 * (y * canvas.width + x) + 3]).some((alpha) => alpha > 128);
    const missing = all.marks.filter(({t}) => {
      const x = Math.round(((t - all.begin) / (all.end - all.begin)) * canvas.width);
      return ![-2, 0, 2].some((off) => isPainted(Math.min(Math.max(x + off, 0), canvas.width - 1)));
    });
    return {missing: missing.map(({t, text}) => `${text} at ${t}`), marks: all.marks.length, states: all.states.length};
  });
  check(axis.marks > 0 && axis.states > 0, `${axis.marks} marks, ${axis.states} states`);
  check(axis.missing.length === 0, `not painted on the time axis: ${axis.missing}`);
  const present = await page.evaluate((queries) => queries.map(([b, at]) => window.dyop.run.isPresent(window.dyop.run.bodies[b], at)),
                                      facts.present.map(({body, t}) => [body, t]));
  facts.present.forEach(({body, t, is}, k) => check(present[k] === is, `body ${body} at ${t} is ${present[k] ? '' : 'not '}there`));
  const states = await page.evaluate((queries) => window.dyop.states(queries), facts.poses.map(({body, t}) => [body, t]));
  facts.poses.forEach(({body, t, p, q}, k) => {
    const state = states[k];
    check(off(state.p, p) <= 0.3 * facts.rest_offset, `body ${body} at ${t}: ${state.p}, not ${p}`);
    const turned = Math.min(off(state.q, q), off(state.q, q.map((x) => -x)));
    check(turned < 1e-3, `body ${body} at ${t} is turned by ${turned}`);
  });
  // What is handed to the renderer; it takes most of the time, and draws once in twenty pictures.
  const boxes = await page.evaluate((queries) => {
    const {player, run: all} = window.dyop;
    const {renderer} = player.stage;
    const render = renderer.render.bind(renderer);
    return queries.map(([b, at], k) => {
      renderer.render = k % 20 === 0 ? render : () => {};
      player.seek(at);
      window.dyop.draw();
      const {min, max} = player.stage.shapes[all.bodies[b].shape].geometry.boundingBox;
      return {low: min.toArray(), high: max.toArray()};
    });
  }, facts.boxes.map(({body, t}) => [body, t]));
  facts.boxes.forEach(({body, t, low, high}, k) => {
    const worst = Math.max(off(boxes[k].low, low), off(boxes[k].high, high));
    check(worst <= facts.rest_offset, `tissue ${body} at ${t} is off by ${worst}`);
  });
  await page.close();
}

try {
  for (let k = 0; k < files.length; k += 2) {
    current = files[k];
    await checkPage(files[k], JSON.parse(fs.readFileSync(files[k + 1], 'utf8')));
  }
} finally {
  await browser.close();
}
process.exit(failures === 0 ? 0 : 1);
