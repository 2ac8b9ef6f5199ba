// SPDX-License-Identifier: BSD-3-Clause
// Follows a run in headless Chromium: `dyop view --live --paused` is resumed by the page, paused,
// watched again by a second page after the first was closed, and stopped. Nothing is timed: the run
// waits for the page, and is longer than any test. It keeps to the clock, so that a page on a slow
// machine is not buried under a run that comes to rest. With `tool`, the same of `dyop tool --live`,
// which cannot be paused.
// Usage: DYOP_PAGE_MODULES=... node check_live.mjs CHROMIUM DYOP SCENE.json [tool]
import {spawn} from 'node:child_process';
import readline from 'node:readline';
import {kLongest, launch} from './browser.mjs';

const [chromium, dyop, scene, kind = 'world'] = process.argv.slice(2);

let failures = 0;
function check(holds, words) {
  if (holds) return;
  ++failures;
  console.log(`FAILED: ${words}`);
}

const words = {
  world: ['view', '--live', scene, '--paused', '--paced', '--json', '--end-with-run'],
  tool: ['tool', scene, '--live', '--seconds', '100000'],  // longer than any test
};
const run = spawn(dyop, words[kind], {stdio: ['ignore', 'pipe', 'inherit']});
const ended = new Promise((done) => run.on('exit', done));
const lines = [];
const address = await new Promise((done) => {
  readline.createInterface({input: run.stdout}).on('line', (line) => {
    lines.push(line);
    if (lines.length === 1) done(kind === 'world' ? JSON.parse(line).address : line.replace('address: ', ''));
  });
});
check(/^http:\/\/127\.0\.0\.1:\d+\/[0-9a-f]{32}\/$/.test(address), `the address ${address}`);

const browser = await launch(chromium);
const problems = [];
async function open() {
  const page = await browser.newPage();
  page.setDefaultTimeout(kLongest);
  await page.setViewport({width: 500, height: 320});
  page.on('console', (message) => message.type() === 'error' && problems.push(message.text()));
  page.on('pageerror', (error) => problems.push(String(error)));
  await page.goto(address);
  await page.waitForFunction('window.dyop', {timeout: kLongest});
  return page;
}
const until = (page, text) => page.waitForFunction(
  (wanted) => document.getElementById('live-state').textContent.startsWith(wanted), {timeout: kLongest}, text);
const grown = (page, t) => page.waitForFunction(
  (last) => window.dyop.run.end > last, {timeout: kLongest}, t);
const end = (page) => page.evaluate(() => window.dyop.run.end);

async function checkWorld() {
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
}

async function checkTool() {
  const page = await open();
  await until(page, 'running');
  await page.waitForFunction('window.dyop.player.t > 0', {timeout: kLongest});  // it follows
  check(await page.evaluate(() => document.getElementById('live-pause').hidden), 'a loop cannot be paused');
  check(await page.evaluate(async () => (await fetch('pause', {method: 'POST'})).status === 409), 'nor by asking');
  // Tissue moves, in ways that come with the run.
  await page.waitForFunction('window.dyop.run.deformations[0].modes.length > 0', {timeout: kLongest});
  check(await page.evaluate(() => {
    const {player, run: all} = window.dyop;
    player.draw();
    return player.stage.shapes[all.bodies[all.deformations[0].body].shape].geometry.attributes.position.array
      .every(Number.isFinite);
  }), 'tissue is somewhere');
  await page.keyboard.press(' ');
  await until(page, 'running; this picture is held');
  const held = await page.evaluate(() => window.dyop.player.t);
  await grown(page, held);
  check((await page.evaluate(() => window.dyop.player.t)) === held, 'a picture that is held stays');
  await page.close();
  check(run.exitCode === null, 'closing the page leaves the run alone');

  const again = await open();
  await grown(again, held);
  await again.waitForFunction((t) => window.dyop.player.t > t, {timeout: kLongest}, held);
  await again.click('#live-stop');
  await until(again, 'ended: stopped by its page after ');
  check(run.exitCode === null, 'the page stays until it is no longer wanted');
  run.kill('SIGINT');
  check((await ended) === 3, `a stopped run is undecided, exit code ${run.exitCode}`);
  check(lines.some((line) => line.startsWith('latency in us')), 'a stopped run is reported');
}

try {
  await {world: checkWorld, tool: checkTool}[kind]();
} catch (error) {
  check(false, String(error));
}
// The server is gone by now; the page says so, the browser as well.
const others = problems.filter((text) => !/Failed to load resource|ERR_CONNECTION/.test(text));
check(others.length === 0, `the console says: ${others.join(' | ')}`);
await browser.close();
run.kill();
process.exit(failures === 0 ? 0 : 1);
