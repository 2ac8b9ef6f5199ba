// SPDX-License-Identifier: BSD-3-Clause
// How soon a page shows its first picture, when all of it is read, and how many pictures a second it
// draws while it plays, in headless Chromium with software rendering.
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
const page = await browser.newPage();
await page.setViewport({width: 1280, height: 720});
await page.goto(pathToFileURL(file), {timeout: 600000, waitUntil: 'commit'}).catch(() => {});
await page.waitForFunction('window.dyop && window.dyop.isReady', {timeout: 600000});
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
console.log(JSON.stringify({megabytes: fs.statSync(file).size / 1e6, ...times}));
await page.screenshot({path: file.replace(/\.html$/, '.png')});
await browser.close();
