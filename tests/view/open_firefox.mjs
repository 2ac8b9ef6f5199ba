// SPDX-License-Identifier: BSD-3-Clause
// Opens a page in Firefox: it must become ready, play, and say nothing on its console. Firefox without
// a window offers no WebGL where there is no graphics card, so it gets a window on a screen that
// nobody sees. Exit code 77 with a reason where Firefox does not start or has no WebGL 2. By hand
// (bash .ci/install.sh firefox):
//   DYOP_PAGE_MODULES=build/npm/node_modules xvfb-run -a -s '-screen 0 1280x800x24' \
//     node tests/view/open_firefox.mjs /usr/bin/firefox-esr PAGE.html [PICTURE.png]
import {createRequire} from 'node:module';
import path from 'node:path';
import {pathToFileURL} from 'node:url';

const kLongest = 180000;  // milliseconds, for one answer of a loaded machine
const [firefox, file, picture] = process.argv.slice(2);
const require = createRequire(path.join(path.resolve(process.env.DYOP_PAGE_MODULES), 'x.js'));

function skip(reason) {
  console.log(`skipped: ${reason}`);
  process.exit(77);
}

const browser = await require('puppeteer-core').launch({
  browser: 'firefox',
  executablePath: firefox,
  headless: false,
  timeout: kLongest,
  protocolTimeout: kLongest,
  extraPrefsFirefox: {'webgl.force-enabled': true, 'webgl.disable-fail-if-major-performance-caveat': true},
}).catch((error) => skip(`Firefox does not start: ${error.message}`));
const problems = [];
try {
  const page = await browser.newPage();
  await page.setViewport({width: 1000, height: 640});
  page.on('console', (message) => message.type() === 'error' && problems.push(message.text()));
  page.on('pageerror', (error) => problems.push(String(error)));
  const hasWebGL = await page.evaluate(() => Boolean(document.createElement('canvas').getContext('webgl2')));
  if (!hasWebGL) {
    await browser.close();
    skip('this Firefox has no WebGL 2');
  }
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
