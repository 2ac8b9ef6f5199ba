// SPDX-License-Identifier: BSD-3-Clause
// Pictures of pages to look at: at three sizes, light and dark, at the start, in the middle, at the
// largest impulse, and close up at the nearest gap. All of it by keys, as a user does.
// Usage: DYOP_PAGE_MODULES=... node screenshots.mjs CHROMIUM OUT PAGE.html...
// Exit code 1 if a page wrote an error to the console.
import {createRequire} from 'node:module';
import os from 'node:os';
import path from 'node:path';
import {pathToFileURL} from 'node:url';

const [chromium, out, ...files] = process.argv.slice(2);
const require = createRequire(path.join(path.resolve(process.env.DYOP_PAGE_MODULES), 'x.js'));
const kSizes = [[1600, 900], [1280, 720], [390, 844]];
const kThemes = ['light', 'dark'];
const kMoments = [
  ['start', async () => {}],
  ['middle', (page) => page.evaluate(() => {
    const {player} = window.dyop;
    player.seek((player.run.begin + player.run.end) / 2);
  })],
  ['impact', (page) => page.keyboard.press('q')],
  ['close-up', async (page) => {
    await page.keyboard.press('q');
    await page.keyboard.press('z');
  }],
];

const browser = await require('puppeteer-core').launch({
  executablePath: chromium,
  headless: true,
  protocolTimeout: 600000,
  args: [...(os.userInfo().uid === 0 ? ['--no-sandbox'] : []), '--enable-unsafe-swiftshader'],
});
let errors = 0;
for (const file of files) {
  const name = path.basename(file, '.html');
  for (const [width, height] of kSizes) {
    for (const theme of kThemes) {
      const page = await browser.newPage();
      const tell = (words) => {
        ++errors;
        console.log(`${name} ${width}x${height} ${theme}: ${words}`);
      };
      page.on('pageerror', (error) => tell(error.message));
      page.on('console', (message) => message.type() === 'error' && tell(message.text()));
      await page.setViewport({width, height});
      await page.goto(`${pathToFileURL(file).href}#theme=${theme}`, {timeout: 600000, waitUntil: 'domcontentloaded'});
      await page.waitForFunction('window.dyop && window.dyop.isReady', {timeout: 600000});
      for (const [moment, go] of kMoments) {
        await go(page);
        await page.evaluate(() => window.dyop.player.draw());
        await page.screenshot({path: path.join(out, `${name}-${width}x${height}-${theme}-${moment}.png`)});
      }
      await page.close();
    }
  }
}
await browser.close();
process.exit(errors > 0 ? 1 : 0);
