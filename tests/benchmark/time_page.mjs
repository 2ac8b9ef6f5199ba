// SPDX-License-Identifier: BSD-3-Clause
// How soon a page shows its first picture, when all of it is read, and how many pictures a second it
// draws while it plays, in headless Chromium with software rendering; and, for a loaded machine, the
// processor time of the browser until then and for each picture.
// Usage: DYOP_PAGE_MODULES=... node time_page.mjs CHROMIUM PAGE.html
import {createRequire} from 'node:module';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import {pathToFileURL} from 'node:url';

const [chromium, file] = process.argv.slice(2);
const require = createRequire(path.join(path.resolve(process.env.DYOP_PAGE_MODULES), 'x.js'));
const browser = await require('puppeteer-core').launch({
  executablePath: chromium,
  headless: true,
  protocolTimeout: 600000,
  args: [...(os.userInfo().uid === 0 ? ['--no-sandbox'] : []), '--enable-unsafe-swiftshader'],
});
// Processor time of the browser and all its children, in seconds.
function processorTime() {
  const numbers = (process) => {
    try {
      return fs.readFileSync(`/proc/${process}/stat`, 'utf8').split(') ').at(-1).split(' ').slice(1).map(Number);
    } catch {
      return [0];  // it has ended
    }
  };
  const processes = new Map(fs.readdirSync('/proc').filter((name) => /^\d+$/.test(name))
    .map((name) => [Number(name), numbers(name)]));
  const isOurs = (id) => id === browser.process().pid || (processes.has(id) && isOurs(processes.get(id)[0]));
  let ticks = 0;
  for (const [id, stat] of processes) if (isOurs(id)) ticks += stat[10] + stat[11];
  return ticks / 100;
}

const page = await browser.newPage();
await page.setViewport({width: 1280, height: 720});
await page.goto(pathToFileURL(file).href, {timeout: 600000, waitUntil: 'domcontentloaded'});
await page.waitForFunction('window.dyop && window.dyop.isReady', {timeout: 600000});
const processorToReady = processorTime();
const kDrawn = 5;
await page.evaluate((count) => {
  const {player} = window.dyop;
  const {begin, end} = player.run;
  const gl = player.stage.renderer.getContext();
  for (let k = 1; k <= count; ++k) {
    player.seek(begin + ((end - begin) * k) / (count + 1));
    player.draw();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));  // waits for the picture
  }
}, kDrawn);
const processorPerPicture = (processorTime() - processorToReady) / kDrawn;
const times = await page.evaluate(async () => {
  const {player, firstPicture} = window.dyop;
  const ready = performance.now();
  player.speed = (player.run.end - player.run.begin) / 20;
  player.seek(player.run.begin);
  player.play(true);
  const before = player.frames;
  const begin = performance.now();
  await new Promise((done) => setTimeout(done, 5000));
  const rate = (1000 * (player.frames - before)) / (performance.now() - begin);
  return {firstPicture, ready, rate, drawCalls: player.stage.renderer.info.render.calls,
          triangles: player.stage.renderer.info.render.triangles};
});
console.log(JSON.stringify({megabytes: fs.statSync(file).size / 1e6, ...times, processorToReady, processorPerPicture}));
await page.screenshot({path: file.replace(/\.html$/, '.png')});
await browser.close();
