// SPDX-License-Identifier: BSD-3-Clause
// A run: its bodies, their motions, and what happened when. Blocks are appended in order of time.
import {evaluate, kKinds, newState, turned} from './motion.js';
import {readSurface} from './blocks.js';
import {ChunkStore} from './chunk.js';
import {growDeformation, readDeformation} from './deformation.js';
import {lastRow, Store, Table} from './store.js';

// Colours of states that last until the next one, in order of their first appearance.
const kStateColors = ['#8a94a6', '#2f9e44', '#d97706', '#d6336c', '#7c3aed', '#0e7490', '#a16207', '#4d7c0f'];
const kTouchFrames = 10;  // without contact, after which a pair touches anew
const kRest = kKinds.indexOf('rest');
const kAbsent = kKinds.indexOf('absent');

const kKeptChunks = 4;

export class Run {
  constructor(head) {
    this.title = head.title;
    this.source = head.source;  // the name of its file
    this.check = head.check;    // what dyop-check said of it, if it was asked
    this.gravity = head.gravity;
    this.links = head.links ?? {};  // joints, springs and locked axes, as in the scene file
    this.begin = head.begin;
    this.end = head.begin;
    this.plannedEnd = head.end;
    this.blocks = 1;  // read so far, the head among them
    this.shapes = [];  // as the blocks describe them
    this.surfaces = [];
    this.bodies = [];
    this.deformations = [];
    this.#addBodies(head);
    this.#grow(head);
    this.keepsTime = Boolean(head.keeps_time);  // while it goes on, it does so by the clock
    this.charts = head.charts ?? [];  // each with a title and its series, columns of `samples`
    this.samples = new Table('t', []);
    // What is looked at: bodies moved by forces, or if there are none those on prescribed motions.
    const ofKind = (kind) => this.bodies.filter((body) => body.kind === kind);
    this.movers = ofKind('dynamic').length > 0 ? ofKind('dynamic') : ofKind('kinematic');
    for (const body of this.movers) body.isMover = true;
    const radii = this.bodies.filter(({kind}) => kind === 'dynamic').map(({radius}) => radius);
    const ordinary = radii.sort((a, b) => a - b)[Math.floor(radii.length / 2)] ?? Infinity;
    for (const body of this.bodies) {
      body.isGround = body.kind === 'static' && !body.color && body.radius > 4 * ordinary;
    }
    // All of an ordinary run. Of a large one its outlines: bodies at a few times, the nearest pairs;
    // the whole is in chunks, which are read when their time is looked at.
    this.base = new Store(this.bodies.length);
    this.chunks = [];  // {begin, end, bytes, store}, in order of time
    this.steps = new Table('end', []);
    this.frames = new Table('end', ['momentum', 'angular_momentum']);
    this.impacts = new Table('t', ['pa', 'pb', 'normal']);
    this.hits = new Table('impact', ['pa', 'pb', 'normal', 'impulse']);
    this.marks = [];
    this.states = [];  // {t, text, number}: what the loop of a haptic run reports, until the next one
    this.stateNames = [];
    this.roughFrames = [];  // whose contact solves ended above their tolerance
    this.touches = [];  // {t, a, b}: a pair comes into contact without an impact of its own
  }

  // Why the run ended, in words; undefined while it goes on.
  get ending() {
    return this.marks.findLast(({kind}) => kind === 'end')?.text;
  }

  // When it ended itself; `end` may be that of a longer run beside it.
  get ownEnd() {
    return Math.max(this.base.end, ...this.chunks.slice(-1).map(({end}) => end), this.begin);
  }

  get isLarge() {
    return this.chunks.length > 0;
  }
  get pairs() {
    return this.base.pairs;
  }
  get gaps() {
    return this.base.gaps;
  }
  get contacts() {
    return this.base.contacts;
  }

  append(block) {
    this.blocks += 1;
    if (block.block === 'chunk') {
      this.chunks.push(block);
      this.end = Math.max(this.end, block.end);
      return;
    }
    if (block.bodies) {
      this.#addBodies(block);
      this.base.grow(this.bodies.length);
    }
    // Frames and impacts first: they say which contacts are new touches.
    this.steps.append(block.columns, 'step');
    const firstFrame = this.frames.append(block.columns, 'frame');
    for (const frame of this.frames.rows.slice(firstFrame)) if (frame.unconverged > 0) this.roughFrames.push(frame);
    this.samples.append(block.columns, 'sample');
    this.#grow(block);
    this.ordinaryImpulse = block.ordinary_impulse;
    const firstImpact = this.impacts.append(block.columns, 'impact');
    for (let k = firstImpact; k < this.impacts.rows.length; ++k) this.impacts.rows[k].number = k;
    const firstHit = this.hits.append(block.columns, 'hit');
    for (let k = firstHit; k < this.hits.rows.length; ++k) {
      const hit = this.hits.rows[k];
      const impact = this.impacts.rows[firstImpact + hit.impact];
      (impact.hits ??= []).push(hit);
    }
    for (const row of this.#tableOf(block.columns, 'touch')) this.touches.push(row);
    for (const group of this.base.append(block.columns)) this.#addTouch(group);
    this.end = Math.max(this.end, this.base.end);
    for (const body of this.bodies) body.stateTime = NaN;
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

  // The bodies of a block, whose shapes are numbered within it.
  #addBodies(block) {
    const first = this.shapes.length;
    this.shapes.push(...block.shapes);
    block.shapes.forEach((_, number) => this.surfaces.push(readSurface(block, number)));
    for (const body of block.bodies) {
      this.bodies.push({
        ...body,
        shape: first + body.shape,
        number: this.bodies.length,
        center: body.center ?? [0, 0, 0],
        sleep: [],  // {t, asleep}, in order of time
        state: newState(),
        stateTime: NaN,
      });
    }
  }

  // What a block says of the bodies that deform.
  #grow(block) {
    (block.deformations ?? []).forEach(({body}, number) => {
      const known = this.deformations.find((one) => one.body === body);
      if (known) return growDeformation(known, block, number);
      this.surfaces[this.bodies[body].shape].deforms = true;
      return this.deformations.push(readDeformation(block, number));
    });
  }

  #tableOf(columns, name) {
    const table = new Table('t', []);
    table.append(columns, name);
    return table.rows;
  }

  #addState({t, text}) {
    if (!this.stateNames.includes(text)) this.stateNames.push(text);
    this.states.push({t, text, number: this.stateNames.indexOf(text)});
  }

  // The colour of a mark that begins a state; undefined for others.
  stateColor({text}) {
    const number = this.stateNames.indexOf(text);
    return number < 0 ? undefined : kStateColors[number % kStateColors.length];
  }

  // The state at time t; undefined if the run has none.
  statusAt(t) {
    return lastRow(this.states, 't', t);
  }

  // A pair comes into contact without an impact of its own.
  #addTouch({contact, last}) {
    const apart = last ? contact.begin - last.end : Infinity;
    const shortly = kTouchFrames * (contact.end - contact.begin);
    const hasHit = this.impacts.rows.slice(this.impacts.at(contact.begin - shortly) + 1)
      .some(({a, b}) => a === contact.a && b === contact.b);
    const isNew = apart > shortly && !last?.rows[0].resting && !hasHit;
    if (isNew && contact.begin > this.begin) this.touches.push({t: contact.end, a: contact.a, b: contact.b});
  }

  // The chunk of time t; undefined if the run has none.
  #chunkAt(t) {
    let low = 0;
    for (let high = this.chunks.length; low + 1 < high;) {
      const middle = (low + high) >>> 1;
      if (this.chunks[middle].begin <= t) low = middle;
      else high = middle;
    }
    return this.chunks[low];
  }

  // What is known in detail at time t: all, or what the chunk that is looked at says.
  #storeAt(t) {
    const {chunk} = this;
    return chunk && t >= chunk.begin && t <= chunk.end ? chunk.store : this.base;
  }

  // Makes time t the one that is looked at. Undefined if that is done at once, else a promise.
  lookAt(t) {
    const wanted = this.#chunkAt(t);
    if (!wanted) return undefined;
    this.wanted = wanted;
    if (!wanted.store) return this.#readWanted(wanted);
    this.#show(wanted);
    // The next one is read ahead where time goes on. Where it is dragged, that would be in the way.
    const step = t - this.lookedAt;
    this.lookedAt = t;
    const goesOn = step > 0 && step < wanted.end - wanted.begin;
    if (goesOn && !this.reading) this.#read(this.chunks[this.chunks.indexOf(wanted) + 1]);
    return undefined;
  }

  // After what is being read now, unless another time is looked at by then.
  async #readWanted(wanted) {
    while (!wanted.store && this.wanted === wanted) await (this.reading ?? this.#read(wanted));
    if (this.wanted === wanted) this.#show(wanted);
  }

  #show(chunk) {
    if (this.chunk === chunk) return;
    this.chunk = chunk;
    for (const body of this.bodies) body.stateTime = NaN;
    this.kept = [chunk, ...(this.kept ?? []).filter((one) => one !== chunk)];
    const next = this.chunks[this.chunks.indexOf(chunk) + 1];
    this.kept.length = Math.min(this.kept.length, kKeptChunks);
    const isKept = (one) => one === next || this.kept.includes(one);
    for (const old of this.chunks) if (old.reading && !isKept(old)) old.store = old.reading = undefined;
  }

  #read(chunk) {
    if (!chunk) return undefined;
    chunk.reading ??= this.reading = chunk.read()
      .then((block) => (chunk.store = new ChunkStore(block, this.bodies)))
      .finally(() => (this.reading = undefined));
    return chunk.reading;
  }

  // Calls visit(begin, end) for every chunk in turn, while all of its time is known in detail.
  async visitAll(visit) {
    for (const chunk of this.chunks) {
      const isKept = chunk.reading !== undefined;
      chunk.store = await this.#read(chunk);
      const shown = this.chunk;
      this.chunk = chunk;
      for (const body of this.bodies) body.stateTime = NaN;
      visit(chunk.begin, chunk.end, chunk.store);
      this.chunk = shown;
      for (const body of this.bodies) body.stateTime = NaN;
      if (!isKept) chunk.store = chunk.reading = undefined;
    }
  }

  // Where the body is and how it moves at time t. It stays where its last segment left it; at the
  // time of an impact its velocity is that after it. The object belongs to the run.
  state(body, t) {
    if (body.stateTime === t) return body.state;
    const store = this.#storeAt(t);
    const track = store.tracks[body.number];
    const k = store.segmentAt(body, t);
    if (k < 0 || track.kinds.values[k] === kAbsent) return body.state;
    const end = track.ends.values[k];
    const inside = Math.min(Math.max(t, track.begins.values[k]), end);
    evaluate(track.kinds.values[k], store.parts[track.parts.values[k]], track.rows.values[k], inside,
             body.center, body.state);
    if (t > end) body.state.v.fill(0), body.state.w.fill(0);
    body.stateTime = t;
    return body.state;
  }

  isPresent(body, t) {
    const store = this.#storeAt(t);
    const k = store.segmentAt(body, t);
    return k >= 0 && store.tracks[body.number].kinds.values[k] !== kAbsent;
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
    const store = this.#storeAt(t);
    return [a, b].every((number) => {
      const k = store.segmentAt(this.bodies[number], t);
      const {kinds, begins} = store.tracks[number];
      return k >= 0 && kinds.values[k] === kRest && begins.values[k] <= from;
    });
  }

  // Contacts of the frame around t, and older ones of pairs at rest since.
  contactsAt(t) {
    const found = [];
    for (const pair of this.#storeAt(t).pairs.values()) {
      const group = pair.groupAt(t);
      if (!group) continue;
      if (group.end >= t || (group.rows[0].resting && this.#rested(pair, group.end, t))) {
        found.push(...group.rows);
      }
    }
    return found;
  }

  // The gap of each near pair as last known at t; a picture asks for them several times.
  gapsAt(t) {
    const store = this.#storeAt(t);
    const known = this.gapsKnown;
    if (known?.t === t && known.store === store && known.blocks === this.blocks) return known.found;
    this.gapsKnown = {t, store, blocks: this.blocks, found: this.#findGaps(t, store)};
    return this.gapsKnown.found;
  }

  #findGaps(t, store) {
    const frame = this.frames.rows[Math.max(0, this.frames.at(t))];
    const oldest = frame ? Math.min(frame.end, t) : t;
    const found = [];
    for (const pair of store.pairs.values()) {
      const gap = pair.gapAt(t);
      if (!gap) continue;
      if (gap.t >= oldest || (gap.resting && this.#rested(pair, gap.t, t))) found.push(gap);
    }
    if (store !== this.base) this.#addMeasured(found, t, oldest);
    return found;
  }

  // The gaps of the pairs that come nearest were measured besides, where chunks have what a step needed.
  #addMeasured(found, t, oldest) {
    for (const pair of this.base.pairs.values()) {
      const gap = pair.gapAt(t);
      if (!(gap?.t >= oldest)) continue;
      const place = found.findIndex(({a, b}) => a === pair.a && b === pair.b);
      if (place < 0) {
        found.push(gap);
      } else if (gap.t >= found[place].t) {
        const {pivot, proof, resting, lower} = found[place];
        found[place] = {...gap, pivot, proof, resting, lower: Math.max(gap.lower, lower)};
      }
    }
  }

  // What a gap is measured to: a body, or a tool with all its parts, for which its first one stands.
  gapName(number) {
    const name = this.bodies[number]?.name ?? '?';
    return this.charts.length > 0 ? name.replace(/, part \d+$/, '') : name;
  }
  sideOf(number) {
    if (this.charts.length === 0) return [number];
    return this.bodies.filter((body) => !body.ghost && this.gapName(body.number) === this.gapName(number))
      .map((body) => body.number);
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
    for (const {a, b, t} of this.touches) meet(a, b, t);
    return Math.max(this.begin, ...firsts.values());
  }

  // Whether anything has come near the body.
  meets({number}) {
    const has = ({a, b}) => a === number || b === number;
    return this.impacts.rows.some(has) || this.touches.some(has) || [...this.pairs.values()].some(has);
  }

  // Of those whose place is known: chunks have that of the nearest only.
  nearestGap(t) {
    let nearest;
    for (const gap of this.gapsAt(t)) {
      const hasPlace = Number.isFinite(gap.pa[0]) || Number.isFinite(gap.pivot[0]);
      if (hasPlace && Number.isFinite(gap.upper) && !(gap.upper >= nearest?.upper)) nearest = gap;
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
