// SPDX-License-Identifier: BSD-3-Clause
// Follows a run in headless Chromium: `dyop view --live` is started, paused, watched again by a
// second page after the first was closed, and stopped.
// Usage: DYOP_PAGE_MODULES=... node check_live.mjs CHROMIUM DYOP SCENE.json
import {spawn} from 'node:child_process';
import {createRequire} from 'node:module';
import os from 'node:os';
import path from 'node:path';
import readline from 'node:readline';

const [chromium, dyop, scene] = process.argv.slice(2);
const require = createRequire(path.join(path.resolve(process.env.DYOP_PAGE_MODULES), 'x.js'));
const puppeteer = require('puppeteer-core');

let failures = 0;
function check(holds, words) {
  if (holds) return;
  ++failures;
  console.log(`FAILED: ${words}`);
}

const run = spawn(dyop, ['view', '--live', scene, '--json', '--end-with-run'],
                  {stdio: ['ignore', 'pipe', 'inherit']});
const ended = new Promise((done) => run.on('exit', done));
const lines = [];
const address = await new Promise((done) => {
  readline.createInterface({input: run.stdout}).on('line', (line) => {
    lines.push(JSON.parse(line));
    if (lines.length === 1) done(lines[0].address);
  });
});
check(/^http:\/\/127\.0\.0\.1:\d+\/[0-9a-f]{32}\/$/.test(address), `the address ${address}`);

const browser = await puppeteer.launch({
  executablePath: chromium,
  headless: true,
  args: [...(os.userInfo().uid === 0 ? ['--no-sandbox'] : []), '--enable-unsafe-swiftshader'],
});
const problems = [];
async function open() {
  const page = await browser.newPage();
  await page.setViewport({width: 800, height: 500});
  page.on('console', (message) => message.type() === 'error' && problems.push(message.text()));
  page.on('pageerror', (error) => problems.push(String(error)));
  await page.goto(address);
  await page.waitForFunction('window.dyop', {timeout: 60000});
  return page;
}
const until = (page, words) => page.waitForFunction(
  (wanted) => document.getElementById('live-state').textContent === wanted, {timeout: 60000}, words);
const end = (page) => page.evaluate(() => window.dyop.run.end);

try {
  const page = await open();
  await until(page, 'running');
  await page.click('#live-pause');
  await until(page, 'paused');
  // What was under way arrives; then nothing may come any more.
  let paused = -1;
  for (let k = 0; k < 30 && (await end(page)) !== paused; ++k) {
    paused = await end(page);
    await new Promise((done) => setTimeout(done, 1000));
  }
  await new Promise((done) => setTimeout(done, 1000));
  check(paused > 0, 'the page has followed the run');
  check((await end(page)) === paused, 'a paused run stands still');
  check(await page.evaluate(() => window.dyop.player.t === window.dyop.run.end), 'the page follows');
  await page.click('#live-pause');
  await until(page, 'running');
  await page.waitForFunction((t) => window.dyop.run.end > t, {timeout: 60000}, paused);
  await page.close();
  check(run.exitCode === null, 'closing the page leaves the run alone');

  const again = await open();
  await again.waitForFunction((t) => window.dyop.run.end > t, {timeout: 60000}, paused);
  await again.evaluate(() => window.dyop.player.seek(0));
  const before = await end(again);
  await again.waitForFunction((t) => window.dyop.run.end > t, {timeout: 60000}, before);
  check(await again.evaluate(() => window.dyop.player.t === 0), 'who looks back is left there');
  await again.click('#live-stop');
  check((await ended) === 3, `a stopped run is undecided, exit code ${run.exitCode}`);
} catch (error) {
  check(false, String(error));
}
// The server is gone by now; the page says so, the browser as well.
const others = problems.filter((text) => !/Failed to load resource|ERR_CONNECTION/.test(text));
check(others.length === 0, `the console says: ${others.join(' | ')}`);
await browser.close();
run.kill();
process.exit(failures === 0 ? 0 : 1);
