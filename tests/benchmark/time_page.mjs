// SPDX-License-Identifier: BSD-3-Clause
// How soon a page shows its first picture, when all of it is read, how long a new time takes until it is
// drawn, how many pictures a second it draws while it plays, and its memory, in headless Chromium with
// software rendering; and, for a loaded machine, the processor time of the browser until then and for
// each picture. Times are in milliseconds, memory in megabytes.
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
  args: ['--enable-precise-memory-info', ...(os.userInfo().uid === 0 ? ['--no-sandbox'] : []), '--enable-unsafe-swiftshader'],
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
const ready = await page.evaluate(() => performance.now());
const processorToReady = processorTime();
const devtools = await page.createCDPSession();
// Of the script, with what it holds outside the heap.
async function memory() {
  await devtools.send('HeapProfiler.collectGarbage');
  return (await page.evaluate(() => performance.memory.usedJSHeapSize)) / 1e6;
}
const memoryAtReady = await memory();
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
// From a time that is asked for until it is read and drawn, all over the run.
const scrubs = await page.evaluate(async () => {
  const {player} = window.dyop;
  const {begin, end} = player.run;
  const gl = player.stage.renderer.getContext();
  const times = [];
  for (let k = 1; k <= 21; ++k) {
    const from = performance.now();
    await window.dyop.show(begin + (end - begin) * ((k * 0.618034) % 1));
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    times.push(performance.now() - from);
    await new Promise((done) => setTimeout(done, 100));
  }
  return times.sort((a, b) => a - b);
});
const scrub = {median: scrubs[10], most: scrubs.at(-1), memory: await memory()};
const times = await page.evaluate(async () => {
  const {player, firstPicture} = window.dyop;
  player.speed = (player.run.end - player.run.begin) / 20;
  player.seek(player.run.begin);
  player.play(true);
  const before = player.frames;
  const begin = performance.now();
  await new Promise((done) => setTimeout(done, 5000));
  const rate = (1000 * (player.frames - before)) / (performance.now() - begin);
  return {firstPicture, rate, drawCalls: player.stage.renderer.info.render.calls,
          triangles: player.stage.renderer.info.render.triangles};
});
console.log(JSON.stringify({megabytes: fs.statSync(file).size / 1e6, ready, ...times, memoryAtReady, scrub, processorToReady, processorPerPicture}));
await page.screenshot({path: file.replace(/\.html$/, '.png')});
await browser.close();
