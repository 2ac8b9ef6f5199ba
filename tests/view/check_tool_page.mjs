// SPDX-License-Identifier: BSD-3-Clause
// Checks the page of a tool's run in headless Chromium against facts of the run.
// Usage: DYOP_PAGE_MODULES=... node check_tool_page.mjs CHROMIUM PAGE.html FACTS.json
// Exit code 0 if every check passes; each failure is one line.
import {createRequire} from 'node:module';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import {pathToFileURL} from 'node:url';

const [chromium, file, factsFile] = process.argv.slice(2);
const require = createRequire(path.join(path.resolve(process.env.DYOP_PAGE_MODULES), 'x.js'));
const puppeteer = require('puppeteer-core');
const facts = JSON.parse(fs.readFileSync(factsFile, 'utf8'));

const kLongest = 180000;  // milliseconds, for one answer of a loaded machine

let failures = 0;
function check(holds, words) {
  if (holds) return;
  ++failures;
  console.log(`FAILED: ${words}`);
}

const off = (a, b) => Math.hypot(...a.map((x, k) => x - b[k]));

const browser = await puppeteer.launch({
  executablePath: chromium,
  timeout: kLongest,
  args: [...(os.userInfo().uid === 0 ? ['--no-sandbox'] : []), '--enable-unsafe-swiftshader'],
});
try {
  const page = await browser.newPage();
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
  for (const {body, t, is} of facts.present) {
    const isShown = await page.evaluate((b, at) => window.dyop.run.isPresent(window.dyop.run.bodies[b], at), body, t);
    check(isShown === is, `body ${body} at ${t} is ${isShown ? '' : 'not '}there`);
  }
  for (const {body, t, p, q} of facts.poses) {
    const state = await page.evaluate((b, at) => window.dyop.state(b, at), body, t);
    check(off(state.p, p) <= 0.3 * facts.rest_offset, `body ${body} at ${t}: ${state.p}, not ${p}`);
    const turned = Math.min(off(state.q, q), off(state.q, q.map((x) => -x)));
    check(turned < 1e-3, `body ${body} at ${t} is turned by ${turned}`);
  }
  for (const {body, t, low, high} of facts.boxes) {
    const drawn = await page.evaluate((b, at) => {
      const {player, run: all} = window.dyop;
      player.seek(at);
      window.dyop.draw();
      const {min, max} = player.stage.shapes[all.bodies[b].shape].geometry.boundingBox;
      return {low: min.toArray(), high: max.toArray()};
    }, body, t);
    const worst = Math.max(off(drawn.low, low), off(drawn.high, high));
    check(worst <= facts.rest_offset, `tissue ${body} at ${t} is off by ${worst}`);
  }
} finally {
  await browser.close();
}
process.exit(failures === 0 ? 0 : 1);
