// SPDX-License-Identifier: BSD-3-Clause
// Opens a page in headless Firefox: it must become ready, play, and say nothing on its console.
// Usage: DYOP_PAGE_MODULES=... node open_firefox.mjs FIREFOX PAGE.html [PICTURE.png]
import {createRequire} from 'node:module';
import path from 'node:path';
import {pathToFileURL} from 'node:url';

const kLongest = 180000;  // milliseconds, for one answer of a loaded machine
const [firefox, file, picture] = process.argv.slice(2);
const require = createRequire(path.join(path.resolve(process.env.DYOP_PAGE_MODULES), 'x.js'));
const browser = await require('puppeteer-core').launch({
  browser: 'firefox',
  executablePath: firefox,
  headless: true,
  timeout: kLongest,
  protocolTimeout: kLongest,
  extraPrefsFirefox: {'webgl.force-enabled': true, 'webgl.disable-fail-if-major-performance-caveat': true},
});
const problems = [];
try {
  const page = await browser.newPage();
  await page.setViewport({width: 1000, height: 640});
  page.on('console', (message) => message.type() === 'error' && problems.push(message.text()));
  page.on('pageerror', (error) => problems.push(String(error)));
  await page.goto(pathToFileURL(file), {timeout: kLongest});
  await page.waitForFunction('window.dyop && window.dyop.isReady', {timeout: kLongest});
  await page.keyboard.press(' ');
  await page.waitForFunction('window.dyop.player.t > window.dyop.run.begin', {timeout: kLongest});
  await page.keyboard.press(' ');
  for (const tab of ['curves', 'events', 'bodies', 'data']) await page.click(`[data-tab=${tab}]`);
  const seen = await page.evaluate(() => {
    const {player, run} = window.dyop;
    player.draw();
    const gl = player.stage.renderer.getContext();
    const pixels = new Uint8Array(4 * gl.drawingBufferWidth * gl.drawingBufferHeight);
    gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return {bodies: run.bodies.length, colors: new Set(new Uint32Array(pixels.buffer)).size};
  });
  if (seen.colors < 20) problems.push(`the picture has ${seen.colors} colours`);
  if (picture) await page.screenshot({path: picture});
  console.log(`${await browser.version()}: ${seen.bodies} bodies, ${seen.colors} colours`);
} catch (error) {
  problems.push(String(error));
}
for (const problem of problems) console.log(`FAILED: ${problem}`);
await browser.close();
process.exit(problems.length === 0 ? 0 : 1);
