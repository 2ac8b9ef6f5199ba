// SPDX-License-Identifier: BSD-3-Clause
// A run: its bodies, their motions, and what happened when. Blocks are appended in order of time.
import {evaluate, kKinds, newState, turned} from './motion.js';
import {readSurface} from './blocks.js';
import {readDeformation} from './deformation.js';

// A list of numbers that grows.
class Column {
  constructor(Type) {
    this.values = new Type(64);
    this.length = 0;
  }
  push(value) {
    if (this.length === this.values.length) {
      const larger = new this.values.constructor(2 * this.length);
      larger.set(this.values);
      this.values = larger;
    }
    this.values[this.length++] = value;
  }
}

// The last k < length with values[k] <= x, or -1.
export function lastAtMost(values, length, x) {
  let low = 0;
  let high = length;
  while (low < high) {
    const middle = (low + high) >>> 1;
    if (values[middle] <= x) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

function lastRow(rows, key, t) {
  let low = 0;
  let high = rows.length;
  while (low < high) {
    const middle = (low + high) >>> 1;
    if (rows[middle][key] <= t) low = middle + 1;
    else high = middle;
  }
  return low > 0 ? rows[low - 1] : undefined;
}

const kTouchFrames = 10;  // without contact, after which a pair touches anew
const kRest = kKinds.indexOf('rest');
const kAbsent = kKinds.indexOf('absent');

// A table whose rows come in order of `key`, in one part a block.
class Table {
  constructor(key, vectors) {
    this.key = key;
    this.vectors = new Set(vectors);
    this.rows = [];
    this.keys = new Column(Float64Array);
  }
  append(columns, name) {
    const prefix = `${name}.`;
    const names = Object.keys(columns).filter((key) => key.startsWith(prefix));
    const count = columns[prefix + this.key]?.length ?? 0;
    const first = this.rows.length;
    for (let k = 0; k < count; ++k) {
      const row = {};
      for (const full of names) {
        const column = columns[full];
        const short = full.slice(prefix.length);
        row[short] = this.vectors.has(short)
          ? [column[k], column[count + k], column[2 * count + k]]
          : column[k];
      }
      this.rows.push(row);
      this.keys.push(row[this.key]);
    }
    return first;
  }
  // The place of the last row at or before t, or -1.
  at(t) {
    return lastAtMost(this.keys.values, this.keys.length, t);
  }
}

export class Run {
  constructor(head) {
    this.title = head.title;
    this.gravity = head.gravity;
    this.links = head.links ?? {};  // joints, springs and locked axes, as in the scene file
    this.begin = head.begin;
    this.end = head.begin;
    this.plannedEnd = head.end;
    this.blocks = 1;  // read so far, the head among them
    this.surfaces = head.shapes.map((_, number) => readSurface(head, number));
    this.deformations = (head.deformations ?? []).map((_, number) => readDeformation(head, number));
    for (const {body} of this.deformations) this.surfaces[head.bodies[body].shape].deforms = true;
    this.charts = head.charts ?? [];  // each with a title and its series, columns of `samples`
    this.samples = new Table('t', []);
    this.bodies = head.bodies.map((body, number) => ({
      ...body,
      number,
      center: body.center ?? [0, 0, 0],
      begins: new Column(Float64Array),
      ends: new Column(Float64Array),
      kinds: new Column(Uint8Array),
      parts: new Column(Uint32Array),
      rows: new Column(Uint32Array),
      sleep: [],  // {t, asleep}, in order of time
      state: newState(),
      stateTime: NaN,
    }));
    // What is looked at: bodies moved by forces, or if there are none those on given motions.
    const ofKind = (kind) => this.bodies.filter((body) => body.kind === kind);
    this.movers = ofKind('dynamic').length > 0 ? ofKind('dynamic') : ofKind('kinematic');
    for (const body of this.movers) body.isMover = true;
    const radii = this.bodies.filter(({kind}) => kind === 'dynamic').map(({radius}) => radius);
    const ordinary = radii.sort((a, b) => a - b)[Math.floor(radii.length / 2)] ?? Infinity;
    for (const body of this.bodies) {
      body.isGround = body.kind === 'static' && !body.color && body.radius > 4 * ordinary;
    }
    this.parts = [];  // columns of one kind from one block
    this.steps = new Table('end', []);
    this.frames = new Table('end', ['momentum', 'angular_momentum']);
    this.impacts = new Table('t', ['pa', 'pb', 'normal']);
    this.hits = new Table('impact', ['pa', 'pb', 'normal', 'impulse']);
    this.gaps = new Table('t', ['pa', 'pb', 'pivot']);
    this.marks = [];
    this.states = [];  // {t, text, number}: what the loop of a haptic run reports, until the next one
    this.stateNames = [];
    this.roughFrames = [];  // whose contact solves ended above their tolerance
    this.touches = [];  // {t, a, b}: a pair comes into contact without an impact of its own
    this.contacts = new Table('begin', ['p', 'normal', 'impulse']);
    this.pairs = new Map();  // by name: gaps, and contacts in groups of one begin
  }

  append(block) {
    this.blocks += 1;
    this.#appendSegments(block.columns);
    this.steps.append(block.columns, 'step');
    const firstFrame = this.frames.append(block.columns, 'frame');
    for (const frame of this.frames.rows.slice(firstFrame)) if (frame.unconverged > 0) this.roughFrames.push(frame);
    this.samples.append(block.columns, 'sample');
    const firstImpact = this.impacts.append(block.columns, 'impact');
    for (let k = firstImpact; k < this.impacts.rows.length; ++k) this.impacts.rows[k].number = k;
    const firstHit = this.hits.append(block.columns, 'hit');
    for (let k = firstHit; k < this.hits.rows.length; ++k) {
      const hit = this.hits.rows[k];
      const impact = this.impacts.rows[firstImpact + hit.impact];
      (impact.hits ??= []).push(hit);
    }
    this.#appendGaps(block.columns);
    this.#appendContacts(block.columns);
    for (const mark of block.marks) {
      this.marks.push(mark);
      if (this.charts.length > 0 && (mark.kind === 'status' || mark.kind === 'stalled')) this.#addState(mark);
      if (mark.kind === 'asleep' || mark.kind === 'woke') {
        for (const b of mark.bodies) {
          this.bodies[b].sleep.push({t: mark.t, asleep: mark.kind === 'asleep'});
        }
      }
      this.end = Math.max(this.end, mark.t);
    }
  }

  #appendSegments(columns) {
    kKinds.forEach((kind, number) => {
      const own = {};
      for (const [name, column] of Object.entries(columns)) {
        if (name.startsWith(`${kind}.`)) own[name.slice(kind.length + 1)] = column;
      }
      if (!own.body || own.body.length === 0) return;
      const part = this.parts.push(own) - 1;
      for (let row = 0; row < own.body.length; ++row) {
        const body = this.bodies[own.body[row]];
        body.pending ??= [];
        body.pending.push({begin: own.begin[row], end: own.end[row], number, part, row});
      }
    });
    for (const body of this.bodies) {
      if (!body.pending) continue;
      body.pending.sort((a, b) => a.begin - b.begin);
      for (const segment of body.pending) {
        body.begins.push(segment.begin);
        body.ends.push(segment.end);
        body.kinds.push(segment.number);
        body.parts.push(segment.part);
        body.rows.push(segment.row);
        this.end = Math.max(this.end, segment.end);
      }
      body.pending = undefined;
      body.stateTime = NaN;
    }
  }

  #addState({t, text}) {
    if (!this.stateNames.includes(text)) this.stateNames.push(text);
    this.states.push({t, text, number: this.stateNames.indexOf(text)});
  }

  // The state at time t; undefined if the run has none.
  statusAt(t) {
    return lastRow(this.states, 't', t);
  }

  #pair(row) {
    const name = `${row.a}-${row.b}`;
    let pair = this.pairs.get(name);
    if (!pair) this.pairs.set(name, (pair = {a: row.a, b: row.b, gaps: [], contacts: []}));
    return pair;
  }

  #appendGaps(columns) {
    const first = this.gaps.append(columns, 'gap');
    for (const gap of this.gaps.rows.slice(first)) this.#pair(gap).gaps.push(gap);
  }

  #appendContacts(columns) {
    const first = this.contacts.append(columns, 'contact');
    for (const contact of this.contacts.rows.slice(first)) {
      const pair = this.#pair(contact);
      const last = pair.contacts.at(-1);
      if (last?.begin === contact.begin) {
        last.rows.push(contact);
        continue;
      }
      pair.contacts.push({begin: contact.begin, end: contact.end, rows: [contact]});
      const apart = last ? contact.begin - last.end : Infinity;
      const shortly = kTouchFrames * (contact.end - contact.begin);
      const hasHit = this.impacts.rows.slice(this.impacts.at(contact.begin - shortly) + 1)
        .some(({a, b}) => a === contact.a && b === contact.b);
      const isNew = apart > shortly && !last?.rows[0].resting && !hasHit;
      if (isNew && contact.begin > this.begin) this.touches.push({t: contact.end, a: contact.a, b: contact.b});
    }
  }

  // Where the body is and how it moves at time t. It stays where its last segment left it; at the
  // time of an impact its velocity is that after it. The object belongs to the run.
  state(body, t) {
    if (body.stateTime === t) return body.state;
    const k = this.#segmentAt(body, t);
    if (k < 0 || body.kinds.values[k] === kAbsent) return body.state;
    const end = body.ends.values[k];
    const inside = Math.min(Math.max(t, body.begins.values[k]), end);
    evaluate(body.kinds.values[k], this.parts[body.parts.values[k]], body.rows.values[k], inside,
             body.center, body.state);
    if (t > end) body.state.v.fill(0), body.state.w.fill(0);
    body.stateTime = t;
    return body.state;
  }

  #segmentAt(body, t) {
    const count = body.begins.length;
    return count === 0 ? -1 : Math.max(0, lastAtMost(body.begins.values, count, t));
  }

  isPresent(body, t) {
    const k = this.#segmentAt(body, t);
    return k >= 0 && body.kinds.values[k] !== kAbsent;
  }

  // The same, into an object of the caller's.
  stateInto(body, t, out) {
    const state = this.state(body, t);
    for (const key of ['p', 'q', 'v', 'w']) out[key] = [...state[key]];
    return out;
  }

  // Its centre of mass in the world.
  centerOf(body, t) {
    const {p, q} = this.state(body, t);
    const arm = turned(q, body.center);
    return p.map((x, k) => x + arm[k]);
  }

  isAsleep(body, t) {
    let asleep = false;
    for (const change of body.sleep) {
      if (change.t > t) break;
      asleep = change.asleep;
    }
    return asleep;
  }

  // Whether both bodies of a pair have stood still from time `from` to t.
  #rested({a, b}, from, t) {
    return [a, b].every((number) => {
      const body = this.bodies[number];
      const k = this.#segmentAt(body, t);
      return k >= 0 && body.kinds.values[k] === kRest && body.begins.values[k] <= from;
    });
  }

  // Contacts of the frame around t, and older ones of pairs at rest since.
  contactsAt(t) {
    const found = [];
    for (const pair of this.pairs.values()) {
      const group = lastRow(pair.contacts, 'begin', t);
      if (!group) continue;
      if (group.end >= t || (group.rows[0].resting && this.#rested(pair, group.end, t))) {
        found.push(...group.rows);
      }
    }
    return found;
  }

  // The gap of each near pair as last known at t.
  gapsAt(t) {
    const frame = this.frames.rows[Math.max(0, this.frames.at(t))];
    const oldest = frame ? Math.min(frame.end, t) : t;
    const found = [];
    for (const pair of this.pairs.values()) {
      const gap = lastRow(pair.gaps, 't', t);
      if (!gap) continue;
      if (gap.t >= oldest || (gap.resting && this.#rested(pair, gap.t, t))) found.push(gap);
    }
    return found;
  }

  // When the last pair met for the first time; the beginning, if none did.
  lastMeeting() {
    const firsts = new Map();
    const meet = (a, b, t) => {
      const name = `${a}-${b}`;
      if (!(firsts.get(name) <= t)) firsts.set(name, t);
    };
    for (const {a, b, t} of this.impacts.rows) meet(a, b, t);
    for (const {a, b, contacts} of this.pairs.values()) {
      if (contacts.length > 0) meet(a, b, contacts[0].begin);
    }
    return Math.max(this.begin, ...firsts.values());
  }

  // Whether anything has come near the body.
  meets({number}) {
    const has = ({a, b}) => a === number || b === number;
    return this.impacts.rows.some(has) || [...this.pairs.values()].some(has);
  }

  nearestGap(t) {
    let nearest;
    for (const gap of this.gapsAt(t)) {
      if (Number.isFinite(gap.upper) && !(gap.upper >= nearest?.upper)) nearest = gap;
    }
    return nearest;
  }

  // An islands number for each body: bodies joined by contacts, but not through fixed ones.
  islandsAt(t) {
    const parent = this.bodies.map((_, k) => k);
    const find = (k) => {
      while (parent[k] !== k) k = parent[k] = parent[parent[k]];
      return k;
    };
    for (const {a, b} of this.contactsAt(t)) {
      const moves = this.bodies[a].kind === 'dynamic' && this.bodies[b].kind === 'dynamic';
      if (moves) parent[find(a)] = find(b);
    }
    return parent.map((_, k) => find(k));
  }
}
