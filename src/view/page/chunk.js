// SPDX-License-Identifier: BSD-3-Clause
// Reads a chunk (src/view/rounded_rows.h), whose columns are whole numbers of steps, as differences from
// what was to be expected. Gaps and contacts stay columns: rows are made of those that are looked at.
import {exponential, kKinds, times as product, turned} from './motion.js';
import {lastAtMost, segmentAt} from './store.js';

const kIsLarge = 0xffffffff;
const kRest = kKinds.indexOf('rest');
const kTwist = kKinds.indexOf('twist');
const kCentral = 8;
const kBoundBits = 12;
const kHasUpper = 64;

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
const kNowhere = Object.freeze([NaN, NaN, NaN]);
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

// The columns of each kind of motion, and of all segments in order, body by body: when, and where in
// the columns of their kind.
function segments({columns, steps}, bodies) {
  const kinds = columns['segment.kind'];
  const counts = {rest: 0, twist: 0, cubic: 0};
  for (const kind of kinds) counts[kKinds[kind & 7]] += 1;
  const out = tables(counts);
  const order = {begins: new Float64Array(kinds.length), ends: new Float64Array(kinds.length),
                 kinds: kinds.map((kind) => kind & 7), rows: new Uint32Array(kinds.length)};
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
      const kind = order.kinds[row];
      const to = out[kKinds[kind]];
      const place = to.next++;
      const isCentral = (kinds[row] & kCentral) !== 0;
      to.body[place] = body;
      to.begin[place] = order.begins[row] = begin;
      to.end[place] = order.ends[row] = end;
      to.central[place] = isCentral ? 1 : 0;
      order.rows[row] = place;
      reader.setCentral(isCentral);
      reader.pose(to, place);
      if (kind === kRest) reader.rest();
      else if (kind === kTwist) reader.twist(to, place, begin, end - begin);
      else reader.cubic(to, place, begin, end - begin);
    }
  });
  const plain = (table) => Object.fromEntries(Object.entries(table)
    .map(([name, column]) => [name, column instanceof Filled ? column.values : column]));
  return {parts: Object.fromEntries(Object.entries(out).map(([kind, table]) => [kind, plain(table)])), order};
}

// What is recorded of some bodies as it is: their screws, and times at which they are absent.
function exactPart(columns, kind) {
  const own = Object.entries(columns).filter(([name]) => name.startsWith(`${kind}.`));
  return Object.fromEntries(own.map(([name, column]) => [name.slice(kind.length + 1), column]));
}

function trackOf(values, first, end) {
  return {values: values.subarray(first, end), length: end - first};
}

// The segments of each body in order of time.
function tracksOf(order, counts, parts) {
  let first = 0;
  const tracks = Array.from(counts, (count) => {
    const end = first + count;
    const track = {begins: trackOf(order.begins, first, end), ends: trackOf(order.ends, first, end),
                   kinds: trackOf(order.kinds, first, end), rows: trackOf(order.rows, first, end)};
    track.parts = track.kinds;
    first = end;
    return track;
  });
  const more = new Map();  // by body
  for (const kind of ['screw', 'absent']) {
    parts[kind].body?.forEach((body, row) => {
      if (!more.has(body)) more.set(body, []);
      more.get(body).push({begin: parts[kind].begin[row], end: parts[kind].end[row], kind: kKinds.indexOf(kind), row});
    });
  }
  for (const [body, added] of more) tracks[body] = withMore(tracks[body], added);
  return tracks;
}

function withMore({begins, ends, kinds, rows}, added) {
  const all = Array.from(begins.values, (begin, k) => (
    {begin, end: ends.values[k], kind: kinds.values[k], row: rows.values[k]}));
  all.push(...added);
  all.sort((a, b) => a.begin - b.begin || a.kind - b.kind);
  const column = (Type, key) => trackOf(Type.from(all, (one) => one[key]), 0, all.length);
  const kindsOfAll = column(Uint8Array, 'kind');
  return {begins: column(Float64Array, 'begin'), ends: column(Float64Array, 'end'), kinds: kindsOfAll,
          parts: kindsOfAll, rows: column(Uint32Array, 'row')};
}

// The vectors of a column of differences; that of a row was expected where that of row from[row] is, or
// at zero if that is negative. Without `from`: where the row before it is.
function vectors(columns, name, step, from) {
  const count = columns[`${name}x`]?.length ?? 0;
  const values = new Float64Array(3 * count);
  ['x', 'y', 'z'].forEach((axis, number) => {
    const steps = columns[`${name}${axis}`];
    const large = columns[`${name}${axis}!`];
    const out = values.subarray(number * count, (number + 1) * count);
    for (let row = 0, next = 0; row < count; ++row) {
      const code = steps[row];
      const before = from ? from[row] : row - 1;
      out[row] = code === kIsLarge ? large[next++] : (before < 0 ? 0 : out[before]) + step * ((code >>> 1) ^ -(code & 1));
    }
  });
  return {count, values};
}

function vectorAt({count, values}, row) {
  return [values[row], values[count + row], values[2 * count + row]];
}

const unfolded = (code) => (code >>> 1) ^ -(code & 1);

// Bounds in single precision, of whose bits the last ones are 0. Lower ones are steps from the row
// before, upper ones, where there are any, from the lower one.
function boundsOf(columns) {
  const flags = columns['gap.flags'];
  const [lower, upper] = [new Float32Array(flags.length), new Float32Array(flags.length).fill(Infinity)];
  const [lowerBits, upperBits] = [lower, upper].map(({buffer}) => new Uint32Array(buffer));
  const [lowerSteps, upperSteps] = [columns['gap.lower'], columns['gap.upper']];
  for (let row = 0, digits = 0, next = 0; row < flags.length; ++row) {
    digits += unfolded(lowerSteps[row]);
    lowerBits[row] = digits << kBoundBits;
    if (flags[row] & kHasUpper) upperBits[row] = (digits + unfolded(upperSteps[next++])) << kBoundBits;
  }
  return [lower, upper];
}

// The gaps of all pairs, pair by pair, each pair's in order of time.
class Gaps {
  constructor({columns, steps}) {
    const flags = columns['gap.flags'];
    this.flags = flags;
    this.t = Float64Array.from(columns['gap.t'], (k) => columns.times[k]);
    [this.lower, this.upper] = boundsOf(columns);
    this.noWidth = steps.contact;
    [this.pa, this.ways] = [vectors(columns, 'gap.pa', steps.place), vectors(columns, 'gap.pb', steps.direction)];
    this.pivots = vectors(columns, 'gap.pivot', steps.contact);
    [this.witness, this.pivot] = [new Int32Array(flags.length), new Int32Array(flags.length)];  // rows of those vectors
    for (let row = 0, witness = 0, pivot = 0; row < flags.length; ++row) {
      this.witness[row] = flags[row] & 2 ? witness++ : -1;
      this.pivot[row] = flags[row] & 4 ? pivot++ : -1;
    }
  }

  // A row of an ordinary table.
  row(row, {a, b}) {
    const {[row]: flags} = this.flags;
    const upper = this.upper[row];
    const [witness, pivot] = [this.witness[row], this.pivot[row]];
    const width = Number.isFinite(upper) && upper > 0 ? upper : this.noWidth;
    const pa = witness < 0 ? kNowhere : vectorAt(this.pa, witness);
    const from = witness < 0 ? kZero : pa;
    return {t: this.t[row], a, b, lower: this.lower[row], upper, resting: flags & 1, proof: (flags >>> 3) & 7, pa,
            pb: witness < 0 ? kNowhere : plus(pa, vectorAt(this.ways, witness), width),
            pivot: pivot < 0 ? kNowhere : plus(from, vectorAt(this.pivots, pivot), 1)};
  }
}

// The contacts of all pairs, pair by pair, each pair's in order of time.
class Contacts {
  constructor({columns, steps}) {
    this.begin = Float64Array.from(columns['contact.begin'], (k) => columns.times[k]);
    this.end = Float64Array.from(columns['contact.begin'], (k, row) => columns.times[k + columns['contact.end'][row]]);
    this.resting = columns['contact.resting'];
    const from = this.#expected(columns['contact_pair.count']);
    this.p = vectors(columns, 'contact.p', steps.contact, from);
    this.normal = vectors(columns, 'contact.normal', steps.direction, from);
    this.impulse = vectors(columns, 'contact.impulse', steps.impulse, from);
  }

  // Of each row the one where it is expected: its like in the frame before, of this pair or the one
  // before it.
  #expected(counts) {
    const from = new Int32Array(this.begin.length);
    let [before, now] = [0, 0];  // where the contacts of the frame before begin, and those of this one
    let pairEnds = 0;
    let pair = 0;
    for (let row = 0; row < from.length; ++row) {
      const isNewPair = row === pairEnds;
      if (isNewPair) pairEnds += counts[pair++];
      if (isNewPair || this.begin[row] !== this.begin[row - 1]) [before, now] = [now, row];
      const same = before + (row - now);
      from[row] = same < now ? same : row - 1;
    }
    return from;
  }

  row(row, {a, b}) {
    return {begin: this.begin[row], end: this.end[row], a, b, resting: this.resting[row], p: vectorAt(this.p, row),
            normal: vectorAt(this.normal, row), impulse: vectorAt(this.impulse, row)};
  }
}

const kNone = {first: 0, end: 0};

// As the Pair of a Store, of rows that are made when they are asked for.
class ChunkPair {
  constructor(a, b, gaps, contacts) {
    [this.a, this.b] = [a, b];
    [this.gapTable, this.contactTable] = [gaps, contacts];
    this.gapRows = this.contactRows = kNone;
  }

  #gap(row) {
    return this.gapTable.row(row, this);
  }
  gapAt(t) {
    const {first, end} = this.gapRows;
    const row = lastAtMost(this.gapTable.t, end, t, first);
    if (row < first) return undefined;
    if (this.lastGap?.row !== row) this.lastGap = {row, gap: this.#gap(row)};
    return this.lastGap.gap;
  }
  get gaps() {
    const {first, end} = this.gapRows;
    return Array.from({length: end - first}, (_, k) => this.#gap(first + k));
  }

  // The contacts of one begin, the last of which is in this row.
  #group(last) {
    const {begin, end} = this.contactTable;
    let first = last;
    while (first > this.contactRows.first && begin[first - 1] === begin[last]) first -= 1;
    const rows = Array.from({length: last - first + 1}, (_, k) => this.contactTable.row(first + k, this));
    return {begin: begin[last], end: end[last], rows, first};
  }
  groupAt(t) {
    const {first, end} = this.contactRows;
    const table = this.contactTable;
    let row = lastAtMost(table.begin, end, t, first);
    if (row < first) return undefined;
    if (table.begin[row] === t) {
      let before = row;
      while (before >= first && table.begin[before] === t) before -= 1;
      if (before >= first && table.end[before] === t) row = before;
    }
    if (this.lastGroup?.row !== row) this.lastGroup = {row, group: this.#group(row)};
    return this.lastGroup.group;
  }
  get contacts() {
    const groups = [];
    for (let row = this.contactRows.end - 1; row >= this.contactRows.first;) {
      groups.push(this.#group(row));
      row = groups.at(-1).first - 1;
    }
    return groups.reverse();
  }
}

// As Store, of one chunk; `bodies` are all of the run.
export class ChunkStore {
  constructor(block, bodies) {
    const {columns} = block;
    const {parts, order} = segments(block, bodies);
    for (const kind of ['screw', 'absent']) parts[kind] = exactPart(columns, kind);
    this.parts = kKinds.map((kind) => parts[kind]);
    this.tracks = tracksOf(order, columns['segment.count'], parts);
    const [gaps, contacts] = [new Gaps(block), new Contacts(block)];
    this.pairs = new Map();  // by name
    const addRows = (name, key) => {
      let first = 0;
      columns[`${name}.count`].forEach((count, number) => {
        const [a, b] = [columns[`${name}.a`][number], columns[`${name}.b`][number]];
        const pair = this.pairs.get(`${a}-${b}`) ?? new ChunkPair(a, b, gaps, contacts);
        pair[key] = {first, end: (first += count)};
        this.pairs.set(`${a}-${b}`, pair);
      });
    };
    addRows('gap_pair', 'gapRows');
    addRows('contact_pair', 'contactRows');
  }

  segmentAt(body, t) {
    return segmentAt(this.tracks[body.number], t);
  }
}
