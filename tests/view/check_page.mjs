// SPDX-License-Identifier: BSD-3-Clause
// Checks a page in headless Chromium against facts of its run; tests/screenshots.sh takes pictures of pages.
// Usage: DYOP_PAGE_MODULES=... node check_page.mjs CHROMIUM PAGE.html FACTS.json
// Exit code 0 if every check passes; each failure is one line.
import fs from 'node:fs';
import {pathToFileURL} from 'node:url';
import {inflateSync} from 'node:zlib';
import {kLongest, launch, require} from './browser.mjs';

const [chromium, file, factsFile] = process.argv.slice(2);
const facts = JSON.parse(fs.readFileSync(factsFile, 'utf8'));

let failures = 0;
function check(holds, words) {
  if (holds) return;
  ++failures;
  console.log(`FAILED: ${words}`);
}

// Rows of RGB bytes of a PNG of 8 bits without interlacing, as Chromium writes it.
function pixelsOf(png) {
  const parts = [];
  let width, height, channels;
  for (let at = 8; at < png.length;) {
    const length = png.readUInt32BE(at);
    const kind = png.toString('latin1', at + 4, at + 8);
    const data = png.subarray(at + 8, at + 8 + length);
    if (kind === 'IHDR') {
      width = data.readUInt32BE(0);
      height = data.readUInt32BE(4);
      channels = data[9] === 6 ? 4 : 3;
    }
    if (kind === 'IDAT') parts.push(data);
    at += 12 + length;
  }
  const raw = inflateSync(Buffer.concat(parts));
  const stride = width * channels;
  const out = Buffer.alloc(stride * height);
  for (let y = 0; y < height; ++y) {
    const filter = raw[y * (stride + 1)];
    for (let x = 0; x < stride; ++x) {
      const left = x >= channels ? out[y * stride + x - channels] : 0;
      const above = y > 0 ? out[(y - 1) * stride + x] : 0;
      const corner = x >= channels && y > 0 ? out[(y - 1) * stride + x - channels] : 0;
      const p = left + above - corner;
      const [pa, pb, pc] = [Math.abs(p - left), Math.abs(p - above), Math.abs(p - corner)];
      const paeth = pa <= pb && pa <= pc ? left : pb <= pc ? above : corner;
      const guess = [0, left, above, (left + above) >> 1, paeth][filter];
      out[y * stride + x] = (raw[y * (stride + 1) + 1 + x] + guess) & 255;
    }
  }
  return (x, y) => {
    const at = Math.round(y) * stride + Math.round(x) * channels;
    return [out[at], out[at + 1], out[at + 2]];
  };
}

const browser = await launch(chromium);
const problems = [];
let requests = 0;

async function open(hash, {width = 920, height = 480} = {}) {
  const page = await browser.newPage();
  await page.setViewport({width, height});
  await page.emulateMediaFeatures([{name: 'prefers-color-scheme', value: 'light'}]);
  page.on('console', (message) => {
    if (message.type() === 'error') problems.push(message.text());
  });
  page.on('pageerror', (error) => problems.push(String(error)));
  page.on('request', (request) => {
    if (!/^(file|data|blob):/.test(request.url())) ++requests;
  });
  await page.goto(pathToFileURL(file) + hash);
  await page.waitForFunction('window.dyop && window.dyop.isReady', {timeout: kLongest});
  return page;
}

const settled = (page) =>
  page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

function angle(p, q) {
  // Measures the rotation between two quaternions; their sign means nothing.
  const length = (v) => Math.hypot(...v);
  const same = length(p.map((x, k) => x - q[k]));
  const opposite = length(p.map((x, k) => x + q[k]));
  return 2 * Math.min(same, opposite);
}

async function checkPoses(page) {
  const states = await page.evaluate((queries) => window.dyop.states(queries),
                                     facts.poses.map(({body, t}) => [body, t]));
  let worst = 0;
  facts.poses.forEach((pose, k) => {
    const size = pose.radius + Math.hypot(...pose.p);
    const off = Math.hypot(...pose.p.map((x, i) => x - states[k].p[i])) / size;
    worst = Math.max(worst, off, angle(pose.q, states[k].q));
  });
  check(facts.poses.length >= 1000, `only ${facts.poses.length} poses to compare`);
  check(worst <= 1e-9, `poses differ by ${worst} of the size`);
  console.log(`${facts.poses.length} poses differ by at most ${worst.toExponential(2)} of the size`);
}

async function checkImpacts(page) {
  const count = await page.evaluate(() => window.dyop.run.impacts.rows.length);
  check(count === facts.impacts.length, `${count} impacts, not ${facts.impacts.length}`);
  await page.keyboard.press('Home');
  for (const impact of facts.impacts.slice(0, 20)) {
    const at = await page.evaluate(() => window.dyop.player.t);
    if (at < impact.t) await page.keyboard.press('ArrowDown');
    const shown = await page.evaluate(({a, b}) => {
      const {player, run} = window.dyop;
      player.draw();
      // What is drawn, in single precision: the instances' matrices.
      const drawn = (number) => {
        const {meshes} = player.stage.shapes[run.bodies[number].shape];
        for (const mesh of meshes) {
          const place = [...mesh.userData.bodies.subarray(0, mesh.count)].indexOf(number);
          const own = mesh.instanceMatrix.array.subarray(16 * place + 12, 16 * place + 15);
          if (place >= 0) return mesh.position.toArray().map((x, k) => x + own[k]);
        }
        return undefined;
      };
      return {t: player.t, a: drawn(a), b: drawn(b), radius: [a, b].map((k) => run.bodies[k].radius)};
    }, impact);
    check(shown.t === impact.t, `jump to impact at ${impact.t} went to ${shown.t}`);
    [['a', impact.X_WA.p], ['b', impact.X_WB.p]].forEach(([key, p], k) => {
      const off = Math.hypot(...p.map((x, i) => x - shown[key][i]));
      const size = shown.radius[k] + Math.hypot(...p);
      check(off <= 1e-6 * size, `body ${impact[key]} at impact ${impact.t} is off by ${off}`);
    });
  }
}

// Each body whose centre is in the picture and not hidden by another shows its own colour there.
async function checkPixels(page, t) {
  await page.evaluate((at) => {
    const {player} = window.dyop;
    player.overlays.show = {};
    player.choose({});
    player.seek(at);
    player.draw();
  }, t);
  await settled(page);
  const places = await page.evaluate(() => {
    const {player, run, project} = window.dyop;
    const canvas = player.stage.canvas.getBoundingClientRect();
    const background = player.stage.scene.background.getStyle();
    return {
      background,
      bodies: run.bodies.map((body) => {
        const state = run.state(body, player.t);
        const box = player.stage.shapes[body.shape].geometry.boundingBox;
        const middle = box.min.clone().add(box.max).multiplyScalar(0.5)
          .applyQuaternion({x: state.q[0], y: state.q[1], z: state.q[2], w: state.q[3]});
        const {x, y, visible} = project(state.p.map((v, k) => v + middle.getComponent(k)));
        const seen = visible && player.stage.pick(x, y) === body;
        const tool = document.elementFromPoint(canvas.left + x, canvas.top + y) !== player.stage.canvas;
        return {x: canvas.left + x, y: canvas.top + y, kind: body.kind, seen: seen && !tool,
                color: player.stage.colors[body.number].getStyle()};
      }),
    };
  });
  const png = Buffer.from(await page.screenshot());
  const pixel = pixelsOf(png);
  const rgb = (style) => style.match(/\d+/g).map(Number);
  const hueOf = (c) => {
    const mean = (c[0] + c[1] + c[2]) / 3 || 1;
    return c.map((x) => x / mean);
  };
  let checked = 0;
  for (const body of places.bodies) {
    if (!body.seen || body.kind !== 'dynamic') continue;
    ++checked;
    const found = pixel(body.x, body.y);
    const off = Math.max(...hueOf(found).map((x, k) => Math.abs(x - hueOf(rgb(body.color))[k])));
    check(off < 0.5, `a body of colour ${body.color} shows rgb(${found}) at its centre, t = ${t}`);
    const ground = rgb(places.background);
    check(found.some((x, k) => Math.abs(x - ground[k]) > 12),
          `the background is where a body should be, t = ${t}`);
  }
  return checked;
}

// A joint's point, as drawn from either body, is one place; its key hides what is drawn.
async function checkJoints(page) {
  const {joints, off, drawn, hidden} = await page.evaluate(() => {
    const {run, player} = window.dyop;
    const {links} = player.overlays;
    let worst = 0;
    for (let k = 0; k <= 20; ++k) {
      const t = run.begin + (k / 20) * (run.end - run.begin);
      for (const [a, b] of links.jointEnds(t)) worst = Math.max(worst, Math.hypot(...a.map((x, i) => x - b[i])));
    }
    const count = () => {
      player.draw();
      return links.layers.joint.balls.list.length;
    };
    const shown = count();
    player.overlays.show.joints = false;
    const none = count();
    player.overlays.show.joints = true;
    return {joints: run.links.joints?.length ?? 0, off: worst, drawn: shown, hidden: none};
  });
  check(joints === (facts.joints ?? 0), `${joints} joints are known, not ${facts.joints ?? 0}`);
  check(drawn === joints && hidden === 0, `${drawn} of ${joints} joints are drawn, ${hidden} when hidden`);
  check(off < 1e-4, `the ends of a joint are drawn ${off} apart`);
}

async function checkPlay(page) {
  await page.keyboard.press('Home');
  const before = await page.evaluate(() => window.dyop.player.t);
  await page.keyboard.press(' ');
  await page.waitForFunction((t) => window.dyop.player.t > t, {timeout: kLongest}, before);
  await page.keyboard.press(' ');
  const [playing, t] = await page.evaluate(() => [window.dyop.player.isPlaying, window.dyop.player.t]);
  check(!playing || t >= facts.end, 'the space bar does not pause');
  await page.keyboard.press('Home');
  await page.keyboard.press('ArrowRight');
  const [stepped, end] = await page.evaluate(() => [window.dyop.player.t, window.dyop.run.steps.rows[0].end]);
  check(stepped === end, `a step on goes to ${stepped}, not to the committed ${end}`);
  await page.keyboard.press('ArrowLeft');
  check(await page.evaluate(() => window.dyop.player.t === window.dyop.run.begin), 'a step back');
  await page.keyboard.press('End');
  check(await page.evaluate((t) => window.dyop.player.t === t, facts.end), 'End goes to the end');
  for (const key of ['t', 'o', 'o', 'o', 'o', ']', 'g', 'g', 'i', 'i', 'x', 'x', 'c', 'w', 'l', 'f', 'd', 'd', 'Escape']) {
    await page.keyboard.press(key);
    await settled(page);
  }
  await page.keyboard.press('?');
  check(await page.evaluate(() => document.getElementById('help').open), 'the list of keys opens');
  await page.keyboard.press('Escape');
  await page.keyboard.press('y');
  const link = await page.evaluate(() => location.hash);
  check(/^#t=.*&cam=/.test(link), `the link ${link} carries time and camera`);
  return link;
}

// The list of events has rows only where it is looked at, follows the time, and can be searched.
async function checkEvents(page) {
  await page.click('[data-tab=events]');
  const read = () => page.evaluate(() => {
    window.dyop.player.draw();
    const {events} = window.dyop.player.panel;
    const rows = [...document.querySelectorAll('.rows .row')];
    const now = document.querySelector('.rows .row.now');
    const box = document.querySelector('.rows').getBoundingClientRect();
    const place = now?.getBoundingClientRect();
    return {all: events.all.length, shown: events.shown.length, rows: rows.length,
            times: events.shown.map(({t}) => t), now: now && events.shown[events.now].t,
            isSeen: place && place.top >= box.top - 1 && place.bottom <= box.bottom + 1,
            text: document.querySelector('#tab-events p').textContent};
  });
  for (const part of [0.9, 0.3, 0.6]) {
    const t = part * facts.end;
    await page.evaluate((at) => window.dyop.player.seek(at), t);
    const list = await read();
    const expected = list.times.filter((at) => at <= t).at(-1);
    check(list.now === expected, `at ${t} the list shows the event of ${list.now}, not of ${expected}`);
    check(expected === undefined || list.isSeen, `the event of ${expected} is out of sight`);
    check(list.rows <= 60, `${list.rows} rows for ${list.all} events`);
  }
  const {a} = facts.impacts[0];
  const name = await page.evaluate((k) => window.dyop.run.bodies[k].name, a);
  await page.type('#tab-events input', name);
  const found = await read();
  const wanted = await page.evaluate((words) => window.dyop.player.panel.events.all.filter(({text, bodies}) =>
    [text, ...bodies.map((k) => window.dyop.run.bodies[k].name)].join(' ').toLowerCase().includes(words.toLowerCase())).length, name);
  check(found.shown === wanted && wanted > 0, `a search for ${name} finds ${found.shown} events, not ${wanted}`);
  await page.$eval('#tab-events input', (input) => {
    input.value = '';
    input.dispatchEvent(new Event('input'));
  });
  await page.select('#tab-events select[aria-label="Kind of event"]', 'impact');
  check((await read()).shown === facts.impacts.length, 'the filter keeps impacts only');
  await page.select('#tab-events select[aria-label="Order"]', 'size');
  const [first, largest] = await page.evaluate(() => {
    const {run, player} = window.dyop;
    const size = ({hits = []}) => Math.max(0, ...hits.map(({impulse}) => Math.hypot(...impulse)));
    return [player.panel.events.shown[0].size, Math.max(...run.impacts.rows.map(size))];
  });
  check(first === largest, `the largest impulse is ${largest}, the first of the list ${first}`);
  await page.click('.worst button');
  const [t, worst] = await page.evaluate((most) => {
    const size = ({hits = []}) => Math.max(0, ...hits.map(({impulse}) => Math.hypot(...impulse)));
    return [window.dyop.player.t, window.dyop.run.impacts.rows.find((row) => size(row) === most).t];
  }, largest);
  check(t === worst, `the largest impulse is at ${worst}, the button goes to ${t}`);
  const [hadImpact, hasImpact] = await page.evaluate(() => {
    const {player} = window.dyop;
    const before = player.chosen.impact;
    [...document.querySelectorAll('.worst button')].find(({textContent}) => textContent.startsWith('Nearest gap')).click();
    return [Boolean(before), Boolean(player.chosen.impact)];
  });
  check(hadImpact && !hasImpact, 'an impact stays chosen at the time of the nearest gap');
  await page.select('#tab-events select[aria-label="Order"]', 'time');
  await page.select('#tab-events select[aria-label="Kind of event"]', '');
  await page.click('[data-tab=data]');
}

// What is under the pointer on the time axis, in words; slow motion; a bar of the length it says.
async function checkOrientation(page) {
  const {t, a} = facts.impacts[0];
  const box = await (await page.$('#timeline')).boundingBox();
  const name = await page.evaluate((k) => window.dyop.run.bodies[k].name, a);
  await page.mouse.move(box.x + (t / facts.end) * box.width, box.y + 20);
  const tip = await page.$eval('#tip', (node) => (node.hidden ? '' : node.textContent));
  check(tip.includes(name) && tip.includes('t = '), `under the pointer stands '${tip}'`);
  await page.mouse.move(box.x + 10, box.y - 200);
  check(await page.$eval('#tip', (node) => node.hidden), 'the words under the pointer go with it');
  await page.keyboard.press('s');
  const [near, far] = await page.evaluate((at) => {
    const {player} = window.dyop;
    const slowness = (time) => ((player.t = time), player.slowness());
    return [slowness(at), slowness(at - 10 * player.speed)];
  }, t);
  check(near < 0.06 && far === 1, `slow motion: ${near} at an impact, ${far} far from all`);
  await page.keyboard.press('s');
  const off = await page.evaluate(() => {
    const {player} = window.dyop;
    player.seek(player.run.begin);
    player.draw();
    const {camera, controls} = player.stage;
    const right = camera.position.clone().set(1, 0, 0).applyQuaternion(camera.quaternion);
    const length = Number(document.querySelector('#where .length').textContent.split(' ')[0]);
    const [from, to] = [0, 1].map((k) => player.stage.project(
      controls.target.clone().addScaledVector(right, k * length).toArray()));
    return Math.hypot(to.x - from.x, to.y - from.y) / document.querySelector('#where .bar').offsetWidth;
  });
  check(Math.abs(off - 1) < 0.05, `the bar is ${off} of the length it says`);
  const licences = await page.$eval('#licences', (node) => node.textContent);
  check(/three\.js authors/.test(licences) && /Leon Sorokin/.test(licences), 'the licences of three.js and uPlot are there');
}

// From the start no fixed body that is drawn solid stands before a part of a moving one.
async function checkWalls(page) {
  const hidden = await page.evaluate(() => {
    const {player, run} = window.dyop;
    player.stage.frame();
    player.view = undefined;
    player.choose({});
    const found = [];
    for (const part of [0, 0.2, 0.7]) {
      player.seek(run.begin + part * (run.end - run.begin));
      player.draw();
      for (const body of run.movers.slice(0, 12)) {
        const {p, q} = run.state(body, player.t);
        for (const own of player.stage.shapes[body.shape].points ?? []) {
          const at = own.clone().applyQuaternion({x: q[0], y: q[1], z: q[2], w: q[3]});
          const {x, y, visible} = player.stage.project(at.toArray().map((v, k) => v + p[k]));
          const seen = visible && player.stage.pick(x, y);
          if (seen && seen.isGround) found.push(`${seen.name} before ${body.name}`);
        }
      }
    }
    return found;
  });
  // A vertex that is drawn in by a little may still lie behind the face of a body on which it rests.
  check(hidden.length <= 2, `walls hide parts of bodies: ${hidden.slice(0, 5).join('; ')}`);
}

// The tree of bodies: search, groups, hiding, colours, following.
async function checkBodies(page) {
  await page.click('[data-tab=bodies]');
  const first = await page.evaluate(() => {
    const {player, run} = window.dyop;
    player.choose({});
    player.draw();
    return run.movers[0].name;
  });
  await page.type('#tab-bodies input[type=search]', first);
  const names = await page.$$eval('#tab-bodies .row.body .what', (nodes) => nodes.map((node) => node.textContent));
  check(names.includes(first) && names.every((name) => name.toLowerCase().includes(first.toLowerCase())),
        `a search for ${first} shows ${names}`);
  const drawn = () => page.evaluate((name) => {
    const {player, run} = window.dyop;
    player.draw();
    const body = run.bodies.find((one) => one.name === name);
    const isDrawn = player.stage.shapes[body.shape].meshes.some((mesh) =>
      [...mesh.userData.bodies.subarray(0, mesh.count)].includes(body.number));
    return {isDrawn, color: player.stage.colors[body.number].getHexString(), chosen: player.chosen.body === body, tracks: Boolean(player.tracks)};
  }, first);
  const row = `#tab-bodies .row.body`;
  check((await drawn()).isDrawn, `${first} is drawn`);
  await page.click(`${row} input[type=checkbox]`);
  check(!(await drawn()).isDrawn, `${first} is hidden`);
  await page.click(`${row} input[type=checkbox]`);
  check((await drawn()).isDrawn, `${first} is drawn again`);
  await page.$eval(`${row} input[type=color]`, (node) => {
    node.value = '#123456';
    node.dispatchEvent(new Event('input'));
  });
  check((await drawn()).color === '123456', `the colour of ${first} is ${(await drawn()).color}`);
  await page.click(`${row} button[aria-label^=Follow]`);
  const followed = await drawn();
  check(followed.chosen && followed.tracks, `the camera follows ${first}`);
  await page.$eval('#tab-bodies input[type=search]', (node) => {
    node.value = '';
    node.dispatchEvent(new Event('input'));
  });
  for (const grouping of ['island', 'joints', 'shape', 'none', 'kind']) {
    await page.select('#tab-bodies select', grouping);
    const count = await page.evaluate(() => window.dyop.player.panel.bodies.list.items.filter(({body}) => body).length);
    check(count === await page.evaluate(() => window.dyop.run.bodies.length), `${count} bodies in groups ${grouping}`);
  }
  await page.evaluate(() => {
    const {player} = window.dyop;
    player.ownColors.clear();
    player.tracks = false;
    player.choose({});
  });
}

// The plane between the nearest pair stands across their shortest way; the proofs of a step are counted.
async function checkProofs(page) {
  await page.click('[data-tab=data]');
  await page.keyboard.press('v');
  const found = await page.evaluate(() => {
    const {player, run} = window.dyop;
    player.overlays.show.witness = true;
    player.choose({});
    const measured = run.gaps.rows.find(({pa, upper}) => Number.isFinite(pa[0]) && Number.isFinite(upper));
    player.seek(measured.t);
    player.draw();
    const {plane, shown} = player.overlays;
    const way = shown.pb.map((x, k) => x - shown.pa[k]);
    const normal = plane.position.clone().set(0, 0, 1).applyQuaternion(plane.quaternion).toArray();
    const along = normal.reduce((sum, x, k) => sum + x * way[k], 0) / Math.hypot(...way);
    const place = plane.position.toArray().map((x, k) => x - (shown.pa[k] + shown.pb[k]) / 2);
    const heading = [...document.querySelectorAll('#tab-data h2')].find((node) => node.textContent.startsWith('Proofs of'));
    const counts = heading ? [...heading.nextElementSibling.querySelectorAll('th')] : [];
    return {visible: plane.visible, along, off: Math.hypot(...place) / Math.hypot(...plane.position.toArray(), 1),
            proofs: run.gapsAt(player.t).filter(({proof}) => proof > 0).length,
            said: counts.reduce((sum, node) => sum + Number(node.textContent), 0)};
  });
  check(found.visible && Math.abs(found.along - 1) < 1e-6 && found.off < 1e-9, `the plane: ${JSON.stringify(found)}`);
  check(found.said === found.proofs, `${found.said} proofs are listed, not ${found.proofs}`);
  await page.keyboard.press('v');
  check(await page.evaluate(() => !window.dyop.player.overlays.show.plane), 'the plane is hidden again');
}

// Two points that are clicked; a cut; charts of one's own; files.
async function checkTools(page) {
  await page.click('[data-tab=view]');
  await page.keyboard.press('f');
  const places = await page.evaluate(() => {
    const {player, run, project} = window.dyop;
    player.seek(run.begin);
    player.draw();
    const canvas = player.stage.canvas.getBoundingClientRect();
    const found = [];
    for (const body of run.movers) {
      const {x, y} = project(run.centerOf(body, player.t));
      const node = document.elementFromPoint(canvas.left + x, canvas.top + y);
      const hit = node === player.stage.canvas && player.stage.pickPoint(x, y);
      if (hit) found.push({x: canvas.left + x, y: canvas.top + y, point: hit.point});
    }
    return found;
  });
  const [from, to] = [places[0], places.at(-1)];
  await page.keyboard.press('u');
  for (const place of [from, to]) await page.mouse.click(place.x, place.y);
  await settled(page);
  const [measured, text] = await page.evaluate(() => [window.dyop.player.measure.distance(window.dyop.player.t),
                                                      document.getElementById('measure').textContent]);
  const expected = Math.hypot(...from.point.map((x, k) => x - to.point[k]));
  check(Math.abs(measured - expected) < 0.02 * expected + 1e-9, `two points are ${measured} apart, not ${expected}`);
  check(/ from .* to /.test(text), `the measure says '${text}'`);
  await page.keyboard.press('u');
  await page.select('#tab-view select', '2');
  const cut = await page.evaluate(() => {
    const {player} = window.dyop;
    player.stage.setCut(2, 0);
    player.draw();
    const canvas = player.stage.canvas;
    const seen = [];
    for (let x = 0.1; x < 1; x += 0.1) {
      for (let y = 0.1; y < 1; y += 0.1) {
        const hit = player.stage.pickPoint(x * canvas.clientWidth, y * canvas.clientHeight);
        if (hit) seen.push(hit.point[2] - player.stage.framed.min.z);
      }
    }
    return {planes: player.stage.renderer.clippingPlanes.length, above: Math.max(-Infinity, ...seen)};
  });
  check(cut.planes === 1 && cut.above <= 1e-6, `a cut leaves bodies up to ${cut.above} above it`);
  await page.select('#tab-view select', '');
  check(await page.evaluate(() => window.dyop.player.stage.renderer.clippingPlanes.length === 0), 'the cut is gone');
  await page.click('[data-tab=curves]');
  await settled(page);
  const before = await page.evaluate(() => window.dyop.player.curves.plots.length);
  const off = await page.evaluate(() => {
    const {player, run} = window.dyop;
    const body = run.movers[0];
    player.curves.add('z', body, body);
    player.draw();
    const [times, values] = player.curves.plots[0].data;
    return Math.max(...times.map((t, k) => Math.abs(run.centerOf(body, t)[2] - values[k])));
  });
  const after = await page.evaluate(() => window.dyop.player.curves.plots.length);
  check(after === before + 1 && off === 0, `${after - before} charts were added, off by ${off}`);
  const csv = await page.evaluate(() => new Promise((done) => {
    const make = URL.createObjectURL;
    URL.createObjectURL = (blob) => {
      URL.createObjectURL = make;
      blob.text().then(done);
      return make.call(URL, blob);
    };
    document.querySelector('#tab-curves button[aria-label$="as CSV"]').click();
  }));
  check(csv.startsWith('"t","') && csv.split('\n').length > 20, `the numbers of a chart begin with ${csv.slice(0, 60)}`);
  await page.click('#tab-curves button[aria-label^=Remove]');
  await settled(page);
  check(await page.evaluate(() => window.dyop.player.curves.plots.length) === before, 'a chart is removed');
  await page.click('[data-tab=data]');
}

// What a stranger wants to know first: the nearest pair at a time, why the run ended.
async function checkQuestions(page) {
  const goTo = async (words) => {
    await page.keyboard.press('a');
    await page.keyboard.type(words);
    await page.keyboard.press('Enter');
    await settled(page);
    return page.evaluate(() => ({t: window.dyop.player.t, isTyped: !document.getElementById('at').hidden,
                                 data: document.getElementById('tab-data').innerText}));
  };
  const wanted = 0.37 * facts.end;
  await page.keyboard.press(' ');  // a typed time stays, also in a run that plays
  const said = await goTo(`${wanted}`.replace('.', ','));
  check(Math.abs(said.t - wanted) <= 1e-9 * facts.end && !said.isTyped, `typed ${wanted}, shown ${said.t}`);
  check(!(await page.evaluate(() => window.dyop.player.isPlaying)), 'the run plays on from a typed time');
  const names = await page.evaluate((t) => {
    const {run} = window.dyop;
    const gaps = run.gapsAt(t).filter(({upper}) => Number.isFinite(upper)).sort((x, y) => x.upper - y.upper);
    return gaps.length > 0 ? [gaps[0].a, gaps[0].b].map((number) => run.bodies[number].name) : undefined;
  }, said.t);
  check(names ? said.data.includes(names.join(' – ')) : said.data.includes('No gap was measured'),
        `the nearest pair, ${names}, is not in the data: ${said.data}`);
  const unread = await goTo('soon');
  check(unread.isTyped && unread.t === said.t, 'what is no time is left to be mended');
  await page.keyboard.press('Escape');
  const end = await goTo('1e9');
  check(end.t === (await page.evaluate(() => window.dyop.run.end)), `beyond the end is the end, not ${end.t}`);
  const ending = await page.evaluate(() => window.dyop.run.ending);
  check(ending && end.data.includes(ending), `why the run ended (${ending}) is not in the data: ${end.data}`);
}

// The accessibility tree, by axe, in light and dark, and on a phone; runs where axe-core is installed.
async function checkAccess() {
  let axe;
  try {
    axe = fs.readFileSync(require.resolve('axe-core/axe.min.js'), 'utf8');
  } catch {
    return console.log('axe-core is not installed: bash .ci/install.sh page');
  }
  const checkTabs = async (page, words) => {
    for (const tab of ['data', 'curves', 'events', 'bodies', 'view']) {
      await page.click(`[data-tab=${tab}]`);
      await settled(page);
      const {violations} = await page.evaluate(() => window.axe.run());
      for (const {id, nodes} of violations) check(false, `axe, ${tab} ${words}: ${id}: ${nodes[0].html}`);
    }
  };
  const page = await open('');
  await page.evaluate(axe);
  await checkTabs(page, 'light');
  await page.emulateMediaFeatures([{name: 'prefers-color-scheme', value: 'dark'}]);
  await page.waitForFunction("document.documentElement.dataset.theme === 'dark'", {timeout: kLongest});
  await checkTabs(page, 'dark');
  await page.close();
  const phone = await open('', {width: 390, height: 844});
  await phone.evaluate(axe);
  check(await phone.$eval('#panel', ({hidden}) => hidden), 'a phone shows the picture first');
  await phone.keyboard.press('p');
  await checkTabs(phone, 'on a phone');
  await phone.close();
}

async function checkFilm() {
  const page = await open(`#t=${0.6 * facts.end}&bare=1`);
  const stamp = await page.$eval('#stamp', (node) => node.checkVisibility() && node.textContent);
  check(String(stamp).startsWith('t = '), `a picture for a film has the clock '${stamp}'`);
  await page.close();
}

async function checkLink(page) {
  const camera = () => page.evaluate(() => window.dyop.player.stage.camera.position.toArray());
  await page.evaluate(() => window.dyop.player.seek(window.dyop.run.end / 3));
  for (const key of [']', 'g', 'o', 't', 'c', 'y']) await page.keyboard.press(key);
  const [link, t, position] = [await page.evaluate(() => location.hash),
                               await page.evaluate(() => window.dyop.player.t), await camera()];
  const other = await open(link);
  check(await other.evaluate((at) => window.dyop.player.t === at, t), 'the link restores the time');
  const restored = await other.evaluate(() => window.dyop.player.stage.camera.position.toArray());
  const off = Math.hypot(...restored.map((x, k) => x - position[k])) / Math.hypot(...position);
  check(off < 1e-4, `the link restores the camera to ${off}`);
  // What is shown, too.
  const shown = () => {
    const {chosen, view, coloring, overlays} = window.dyop.player;
    return JSON.stringify([chosen.body.name, view, coloring, overlays.show]);
  };
  check(await other.evaluate(shown) === await page.evaluate(shown), 'the link restores what is shown');
  await other.close();
}

try {
  const page = await open('');
  const first = await page.evaluate(() => window.dyop.firstPicture);
  console.log(`first picture after ${Math.round(first)} ms`);
  await checkPoses(page);
  await checkImpacts(page);
  let seen = 0;
  for (const part of [0, 0.4, 1]) seen += await checkPixels(page, part * facts.end);
  check(seen > 0, 'no body was seen');
  console.log(`${seen} bodies are seen where they are`);
  await page.evaluate(() => {
    window.dyop.player.overlays.show = {contacts: true, witness: true, joints: true, trails: false, plane: false};
  });
  await checkJoints(page);
  await checkPlay(page);
  await checkLink(page);
  await checkEvents(page);
  await checkOrientation(page);
  await checkWalls(page);
  await checkBodies(page);
  await checkProofs(page);
  await checkTools(page);
  await checkQuestions(page);
  if (facts.checksAccess) await checkAccess();
  await checkFilm();
} catch (error) {
  check(false, String(error));
}
check(problems.length === 0, `the console says: ${problems.join(' | ')}`);
check(requests === 0, `${requests} requests over the network`);
await browser.close();
process.exit(failures === 0 ? 0 : 1);
