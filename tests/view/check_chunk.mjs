// SPDX-License-Identifier: BSD-3-Clause
// Reads a chunk by the page's own modules, without a browser, and compares it with what the library
// says of the same motions, gaps and contacts. Usage: node check_chunk.mjs PAGE_SOURCES HEAD CHUNK FACTS.json
import fs from 'node:fs';
import path from 'node:path';
import {pathToFileURL} from 'node:url';

const [sources, headFile, chunkFile, factsFile] = process.argv.slice(2);
const module = (name) => import(pathToFileURL(path.resolve(sources, name)));
const {readBlock} = await module('blocks.js');
const {Run} = await module('run.js');
const bytes = (file) => new Uint8Array(fs.readFileSync(file));
const facts = JSON.parse(fs.readFileSync(factsFile, 'utf8'));

let failures = 0;
function check(holds, words) {
  if (holds || ++failures > 20) return;
  console.log(`FAILED: ${words}`);
}

const run = new Run(await readBlock(bytes(headFile)));
run.append(await readBlock(bytes(chunkFile)));
await run.lookAt(facts.begin);
const apart = (a, b) => Math.hypot(...a.map((x, k) => x - b[k]));
const turnBetween = (p, q) => 2 * Math.min(...[1, -1].map((sign) => apart(p, q.map((x) => sign * x))));

let worst = 0;
for (const {body, t, p, q, v} of facts.poses) {
  const one = run.bodies[body];
  check(run.isPresent(one, t) === (p !== undefined), `body ${body} at t = ${t}: ${run.isPresent(one, t)}`);
  if (p === undefined) continue;
  const state = run.state(one, t);
  const off = apart(state.p, p) + one.radius * turnBetween(state.q, q);
  worst = Math.max(worst, off / facts.place);
  check(off <= 4 * facts.place + 1e-15 * Math.hypot(...p), `body ${body} at t = ${t} is off by ${off}, ${off / facts.place} steps`);
  check(apart(state.v, v) <= 8 * facts.velocity, `velocity of body ${body} at t = ${t} is off by ${apart(state.v, v)}, a step is ${facts.velocity}`);
}
console.log(`${facts.poses.length} poses, at most ${worst.toFixed(2)} steps off`);

const pairs = run.chunk.store.pairs;
const of = ({a, b}) => pairs.get(`${a}-${b}`);
for (const gap of facts.gaps) {
  const found = of(gap).gaps.find(({t}) => t === gap.t);
  const isKnown = gap.upper !== null;
  const least = gap.lower - Math.abs(gap.lower) * 2 ** (isKnown ? -10 : -5);
  check(found.lower <= gap.lower && found.lower >= least, `a lower bound of ${gap.lower} is ${found.lower}`);
  check(isKnown ? found.upper >= gap.upper && found.upper <= gap.upper * (1 + 2 ** -10) : found.upper === Infinity, `an upper bound of ${gap.upper} is ${found.upper}`);
  check(found.resting === (gap.resting ? 1 : 0) && found.proof === gap.proof, `rest and proof: ${found.resting}, ${found.proof}`);
  check(apart(found.pa, gap.pa) <= facts.place, `a witness point is off by ${apart(found.pa, gap.pa)}`);
  const way = (of_) => of_.pb.map((x, k) => x - of_.pa[k]);
  const rounding = 1e-15 * Math.hypot(...gap.pa);  // of the page's numbers themselves
  check(apart(way(found), way(gap)) <= 2 ** -12 * found.upper + rounding, `the way across a gap is off by ${apart(way(found), way(gap))} of ${gap.upper}`);
  check(apart(found.pivot, gap.pivot) <= 2 * facts.contact, `a pivot is off by ${apart(found.pivot, gap.pivot)}`);
}
let contacts = 0;
for (const contact of facts.contacts) {
  const group = of(contact).contacts.find(({begin}) => begin === contact.begin);
  const found = group.rows[contact.number];
  ++contacts;
  check(group.end === contact.end && found.resting === (contact.resting ? 1 : 0), 'time and rest of a contact');
  check(apart(found.p, contact.p) <= facts.contact, `a contact is off by ${apart(found.p, contact.p)}`);
  check(apart(found.normal, contact.normal) <= 2 ** -13, `a normal is off by ${apart(found.normal, contact.normal)}`);
  check(apart(found.impulse, contact.impulse) <= facts.impulse, `an impulse is off by ${apart(found.impulse, contact.impulse)}`);
}
check(contacts === facts.contacts.length && contacts > 0, `${contacts} contacts`);
process.exit(failures === 0 ? 0 : 1);
