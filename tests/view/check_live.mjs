// SPDX-License-Identifier: BSD-3-Clause
// Follows a run in headless Chromium: `dyop view --live --paused` is resumed by the page, paused,
// watched again by a second page after the first was closed, and stopped. Nothing is timed: the run
// waits for the page, and is longer than any test. It keeps to the clock, so that a page on a slow
// machine is not buried under a run that comes to rest.
// Usage: DYOP_PAGE_MODULES=... node check_live.mjs CHROMIUM DYOP SCENE.json
import {spawn} from 'node:child_process';
import {createRequire} from 'node:module';
import os from 'node:os';
import path from 'node:path';
import readline from 'node:readline';

const [chromium, dyop, scene] = process.argv.slice(2);
const require = createRequire(path.join(path.resolve(process.env.DYOP_PAGE_MODULES), 'x.js'));
const puppeteer = require('puppeteer-core');

const kLongest = 180000;  // milliseconds, for one answer of a loaded machine

let failures = 0;
function check(holds, words) {
  if (holds) return;
  ++failures;
  console.log(`FAILED: ${words}`);
}

const run = spawn(dyop, ['view', '--live', scene, '--paused', '--paced', '--json', '--end-with-run'],
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
  timeout: kLongest,
  protocolTimeout: kLongest,
  args: [...(os.userInfo().uid === 0 ? ['--no-sandbox'] : []), '--enable-unsafe-swiftshader'],
});
const problems = [];
async function open() {
  const page = await browser.newPage();
  page.setDefaultTimeout(kLongest);
  await page.setViewport({width: 800, height: 500});
  page.on('console', (message) => message.type() === 'error' && problems.push(message.text()));
  page.on('pageerror', (error) => problems.push(String(error)));
  await page.goto(address);
  await page.waitForFunction('window.dyop', {timeout: kLongest});
  return page;
}
const until = (page, words) => page.waitForFunction(
  (wanted) => document.getElementById('live-state').textContent === wanted, {timeout: kLongest}, words);
const grown = (page, t) => page.waitForFunction(
  (last) => window.dyop.run.end > last, {timeout: kLongest}, t);
const end = (page) => page.evaluate(() => window.dyop.run.end);

try {
  const page = await open();
  await until(page, 'paused');
  check((await end(page)) === 0, 'a run that starts paused waits for its page');
  check(await page.evaluate(() => window.dyop.run.bodies.every((body) => window.dyop.run.isPresent(body, 0))),
        'the bodies are seen before the run starts');
  await page.click('#live-pause');
  await grown(page, 0);
  await page.click('#live-pause');
  // The page is told so only when the run stands still, and the page has all of it.
  await until(page, 'paused');
  const paused = await end(page);
  const answers = await page.evaluate(async () => {
    const found = [];
    for (let k = 0; k < 20; ++k) {
      const answer = await fetch(`blocks/${window.dyop.run.blocks}`);
      found.push(`${answer.status} ${answer.headers.get('X-Dyop-State')}`);
    }
    return found;
  });
  check(answers.every((answer) => answer === '204 paused'), `a paused run stands still: ${answers}`);
  check((await end(page)) === paused, 'a paused run stands still');
  check(await page.evaluate(() => window.dyop.player.t === window.dyop.run.end), 'the page follows');
  await page.click('#live-pause');
  await grown(page, paused);
  await page.close();
  check(run.exitCode === null, 'closing the page leaves the run alone');

  const again = await open();
  await grown(again, paused);
  await again.evaluate(() => window.dyop.player.seek(0));
  const before = await end(again);
  await grown(again, before);
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
