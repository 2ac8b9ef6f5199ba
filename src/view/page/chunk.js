// SPDX-License-Identifier: BSD-3-Clause
// Makes the columns of an ordinary block of those of a chunk (src/view/rounded_rows.h), which are
// whole numbers of steps, as differences from what was to be expected.
import {exponential, kKinds, times as product, turned} from './motion.js';

const kIsLarge = 0xffffffff;
const kRest = kKinds.indexOf('rest');
const kTwist = kKinds.indexOf('twist');
const kCentral = 8;

// Reads the columns of one quantity, row by row, into `out`.
class Vectors {
  constructor(columns, name) {
    this.axes = ['x', 'y', 'z'].map((axis) => ({steps: columns[`${name}${axis}`], large: columns[`${name}${axis}!`], next: 0}));
    this.row = 0;
  }
  read(expected, step, out = [0, 0, 0]) {
    const row = this.row++;
    for (let k = 0; k < 3; ++k) {
      const axis = this.axes[k];
      const code = axis.steps[row];
      out[k] = code === kIsLarge ? axis.large[axis.next++] : expected[k] + step * ((code >>> 1) ^ -(code & 1));
    }
    return out;
  }
}

// A column of vectors that is filled row by row: all x, then all y, then all z.
class Filled {
  constructor(count) {
    this.count = count;
    this.values = new Float64Array(3 * count);
  }
  set(row, v) {
    for (let k = 0; k < 3; ++k) this.values[k * this.count + row] = v[k];
  }
}

const kZero = [0, 0, 0];
const conjugate = (q) => [-q[0], -q[1], -q[2], q[3]];
const plus = (a, b, factor) => [a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]];
const turnBy = (a, b) => product(a, b, [0, 0, 0, 1]);

// The columns of each kind of motion, with so many rows.
function tables(counts) {
  const columnsOf = (count, names, numbers) => ({
    next: 0,
    body: new Uint32Array(count), begin: new Float64Array(count), end: new Float64Array(count), central: new Uint8Array(count),
    qw: new Float64Array(count), ...Object.fromEntries([...['p', 'q'], ...names].map((name) => [name, new Filled(count)])),
    ...Object.fromEntries(numbers.map((name) => [name, new Float64Array(count)])),
  });
  return {
    rest: columnsOf(counts.rest, [], []),
    twist: columnsOf(counts.twist, ['v', 'w'], ['t0']),
    cubic: columnsOf(counts.cubic, ['p0', 'v0', 'theta0', 'theta_rate0', 'p1', 'v1', 'theta1', 'theta_rate1'], ['domain_begin', 'domain_end']),
  };
}

// Where segments leave a body, which the next one goes on from: as MotionRows::add_rounded_to().
class Reader {
  constructor(columns, steps) {
    this.steps = steps;
    for (const name of ['p', 'turn', 'v', 'w', 'angle', 'next_v', 'next_rate', 'next_p', 'next_angle']) {
      this[name] = new Vectors(columns, `segment.${name}`);
    }
  }
  start({center, radius}) {
    this.center = center;
    this.isCentral = false;
    this.at = {p: kZero, q: [0, 0, 0, 1], v: kZero, w: kZero};
    this.turnStep = radius > 0 ? this.steps.place / radius : 2 ** -26;
  }
  // The steps of velocities and of angular velocities over a segment of length h.
  #rateSteps(h) {
    const {velocity, place} = this.steps;
    const step = h > 0 ? Math.min(velocity, place / h) : velocity;
    return [step, (step / place) * this.turnStep];
  }
  setCentral(isCentral) {
    if (isCentral !== this.isCentral) this.at.p = plus(this.at.p, turned(this.at.q, this.center), isCentral ? 1 : -1);
    this.isCentral = isCentral;
  }
  pose(to, row) {
    const {at} = this;
    at.p = this.p.read(at.p, this.steps.place);
    at.q = turnBy(at.q, exponential(...this.turn.read(kZero, this.turnStep)));
    this.#set(to, row, at.p, at.q);
  }
  #set(to, row, p, q) {
    to.p.set(row, p);
    to.q.set(row, q);
    to.qw[row] = q[3];
  }
  rest() {
    this.at.v = this.at.w = kZero;
  }
  twist(to, row, begin, h) {
    const {at} = this;
    const [step, spinStep] = this.#rateSteps(h);
    at.v = this.v.read(at.v, step);
    at.w = this.w.read(at.w, spinStep);
    to.v.set(row, at.v);
    to.w.set(row, at.w);
    to.t0[row] = begin;
    at.p = plus(at.p, at.v, h);
    at.q = turnBy(exponential(h * at.w[0], h * at.w[1], h * at.w[2]), at.q);
  }
  cubic(to, row, begin, h) {
    const {at, steps} = this;
    const [step, spinStep] = this.#rateSteps(h);
    const angle = this.angle.read(kZero, this.turnStep);
    const chart = turnBy(at.q, exponential(-angle[0], -angle[1], -angle[2]));
    const v0 = this.v.read(at.v, step);
    const rate0 = this.w.read(turned(conjugate(chart), at.w), spinStep);
    const v1 = this.next_v.read(v0, step);
    const rate1 = this.next_rate.read(rate0, spinStep);
    const p1 = this.next_p.read(plus(at.p, plus(v0, v1, 1), h / 2), steps.place);
    const angle1 = this.next_angle.read(plus(angle, plus(rate0, rate1, 1), h / 2), this.turnStep);
    const values = {p0: at.p, v0, theta0: angle, theta_rate0: rate0, p1, v1, theta1: angle1, theta_rate1: rate1};
    for (const [name, value] of Object.entries(values)) to[name].set(row, value);
    this.#set(to, row, at.p, chart);
    to.domain_begin[row] = begin;
    to.domain_end[row] = begin + h;
    this.at = {p: p1, q: turnBy(chart, exponential(...angle1)), v: v1, w: turned(chart, rate1)};
  }
}

function segments({columns, steps}, bodies) {
  const kinds = columns['segment.kind'];
  const counts = {rest: 0, twist: 0, cubic: 0};
  for (const kind of kinds) counts[kKinds[kind & 7]] += 1;
  const out = tables(counts);
  const reader = new Reader(columns, steps);
  const {times} = columns;
  let row = 0;
  columns['segment.count'].forEach((count, body) => {
    reader.start(bodies[body]);
    let last = 0;
    for (let k = 0; k < count; ++k, ++row) {
      const first = (last + columns['segment.begin'][row]) >>> 0;
      last = first + columns['segment.end'][row];
      const [begin, end] = [times[first], times[last]];
      const kind = kinds[row] & 7;
      const to = out[kKinds[kind]];
      const place = to.next++;
      const isCentral = (kinds[row] & kCentral) !== 0;
      to.body[place] = body;
      to.begin[place] = begin;
      to.end[place] = end;
      to.central[place] = isCentral ? 1 : 0;
      reader.setCentral(isCentral);
      reader.pose(to, place);
      if (kind === kRest) reader.rest();
      else if (kind === kTwist) reader.twist(to, place, begin, end - begin);
      else reader.cubic(to, place, begin, end - begin);
    }
  });
  const found = {};
  for (const [kind, table] of Object.entries(out)) {
    for (const [name, column] of Object.entries(table)) {
      if (name !== 'next') found[`${kind}.${name}`] = column instanceof Filled ? column.values : column;
    }
  }
  return found;
}

// The bodies of each row of a list of pairs.
function pairNames(columns, name, total) {
  const names = {a: new Uint32Array(total), b: new Uint32Array(total)};
  let row = 0;
  columns[`${name}.count`].forEach((count, pair) => {
    for (let k = 0; k < count; ++k, ++row) {
      names.a[row] = columns[`${name}.a`][pair];
      names.b[row] = columns[`${name}.b`][pair];
    }
  });
  return names;
}

function gaps({columns, steps}) {
  const flags = columns['gap.flags'];
  const count = flags.length;
  const {times} = columns;
  const {a, b} = pairNames(columns, 'gap_pair', count);
  const [pa, pb, pivot] = ['pa', 'pb', 'pivot'].map((name) => new Vectors(columns, `gap.${name}`));
  const out = {pa: new Filled(count), pb: new Filled(count), pivot: new Filled(count)};
  const unknown = [NaN, NaN, NaN];
  let [place, way, middle] = [kZero, kZero, kZero];
  for (let row = 0; row < count; ++row) {
    const [hasWitness, hasPivot] = [flags[row] & 2, flags[row] & 4];
    const upper = columns['gap.upper'][row];
    if (hasWitness) {
      place = pa.read(place, steps.place);
      way = pb.read(way, steps.direction);
    }
    if (hasPivot) middle = pivot.read(middle, steps.contact);
    const width = Number.isFinite(upper) && upper > 0 ? upper : steps.contact;
    out.pa.set(row, hasWitness ? place : unknown);
    out.pb.set(row, hasWitness ? way.map((x) => x * width) : unknown);
    out.pivot.set(row, hasPivot ? middle : unknown);
  }
  return {
    'gap.t': Float64Array.from(columns['gap.t'], (k) => times[k]), 'gap.a': a, 'gap.b': b,
    'gap.lower': columns['gap.lower'], 'gap.upper': columns['gap.upper'],
    'gap.resting': flags.map((x) => x & 1), 'gap.proof': flags.map((x) => x >>> 3),
    'gap.pa': out.pa.values, 'gap.pb': out.pb.values, 'gap.pivot': out.pivot.values,
  };
}

function contacts({columns, steps}) {
  const begins = columns['contact.begin'];
  const count = begins.length;
  const {times} = columns;
  const {a, b} = pairNames(columns, 'contact_pair', count);
  const read = ['p', 'normal', 'impulse'].map((name) => new Vectors(columns, `contact.${name}`));
  const stepsOf = [steps.contact, steps.direction, steps.impulse];
  const out = read.map(() => new Filled(count));
  const nothing = [kZero, kZero, kZero];
  let [before, now] = [[], []];
  for (let row = 0; row < count; ++row) {
    const isSame = row > 0 && a[row] === a[row - 1] && b[row] === b[row - 1] && begins[row] === begins[row - 1];
    if (!isSame) [before, now] = [now, []];
    const expected = before[now.length] ?? now.at(-1) ?? before.at(-1) ?? nothing;
    now.push(read.map((vectors, k) => vectors.read(expected[k], stepsOf[k])));
    now.at(-1).forEach((v, k) => out[k].set(row, v));
  }
  return {
    'contact.begin': Float64Array.from(begins, (k) => times[k]),
    'contact.end': Float64Array.from(begins, (k, row) => times[k + columns['contact.end'][row]]),
    'contact.a': a, 'contact.b': b, 'contact.resting': columns['contact.resting'],
    'contact.p': out[0].values, 'contact.normal': out[1].values, 'contact.impulse': out[2].values,
  };
}

// The columns of a chunk as those of an ordinary block; `bodies` are all of the run.
export function columnsOfChunk(block, bodies) {
  const rest = Object.entries(block.columns).filter(([name]) => /^(absent|screw)\./.test(name));
  return {...Object.fromEntries(rest), ...segments(block, bodies), ...gaps(block), ...contacts(block)};
}
