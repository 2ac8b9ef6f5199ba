// SPDX-License-Identifier: BSD-3-Clause
// What is known of a span of time: the motions of all bodies, and what was near what.
import {kKinds} from './motion.js';

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

// The last k < length with values[k] <= x, not before `first`; or first - 1.
export function lastAtMost(values, length, x, first = 0) {
  let low = first;
  let high = length;
  while (low < high) {
    const middle = (low + high) >>> 1;
    if (values[middle] <= x) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

export function lastRow(rows, key, t) {
  return rows[lastPlace(rows, key, t)];
}

// The place of the last row with key <= t, or -1.
function lastPlace(rows, key, t) {
  let low = 0;
  let high = rows.length;
  while (low < high) {
    const middle = (low + high) >>> 1;
    if (rows[middle][key] <= t) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

// A table whose rows come in order of `key`, in one part a block.
export class Table {
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

// Two bodies that were near each other: their gaps, and their contacts in groups of one begin.
class Pair {
  constructor({a, b}) {
    [this.a, this.b] = [a, b];
    this.gaps = [];
    this.contacts = [];
  }
  // As last known at t.
  gapAt(t) {
    return lastRow(this.gaps, 't', t);
  }
  // The contacts that are known at t: where a frame ends and the next one begins, those of the one that
  // ends, which are where bodies are.
  groupAt(t) {
    const {contacts} = this;
    const place = lastPlace(contacts, 'begin', t);
    return place > 0 && contacts[place].begin === t && contacts[place - 1].end === t ? contacts[place - 1] : contacts[place];
  }
}

// Of the segments of a body, the last one that begins by t, or the first; -1 if there are none.
export function segmentAt({begins}, t) {
  return begins.length === 0 ? -1 : Math.max(0, lastAtMost(begins.values, begins.length, t));
}

// The motions of all bodies over a span of time, and what was near what in it.
export class Store {
  constructor(bodyCount) {
    this.tracks = [];
    this.grow(bodyCount);
    this.parts = [];  // columns of one kind from one block
    this.gaps = new Table('t', ['pa', 'pb', 'pivot']);
    this.contacts = new Table('begin', ['p', 'normal', 'impulse']);
    this.pairs = new Map();  // by name: gaps, and contacts in groups of one begin
    this.end = -Infinity;
  }

  grow(bodyCount) {
    while (this.tracks.length < bodyCount) {
      this.tracks.push({
        begins: new Column(Float64Array),
        ends: new Column(Float64Array),
        kinds: new Column(Uint8Array),
        parts: new Column(Uint32Array),
        rows: new Column(Uint32Array),
      });
    }
  }

  append(columns) {
    this.#appendSegments(columns);
    const gaps = this.gaps.rows.slice(this.gaps.append(columns, 'gap'));
    for (const gap of gaps) {
      // Recorded as offsets from the point of A, so that they are exact where it counts.
      if (Number.isFinite(gap.pa[0])) {
        for (const name of ['pb', 'pivot']) gap[name].forEach((x, k) => (gap[name][k] = gap.pa[k] + x));
      }
      this.#pair(gap).gaps.push(gap);
    }
    const contacts = this.contacts.rows.slice(this.contacts.append(columns, 'contact'));
    return contacts.map((contact) => this.#addContact(contact)).filter(Boolean);
  }

  #appendSegments(columns) {
    const found = [];
    kKinds.forEach((kind, number) => {
      const own = {};
      for (const [name, column] of Object.entries(columns)) {
        if (name.startsWith(`${kind}.`)) own[name.slice(kind.length + 1)] = column;
      }
      if (!own.body || own.body.length === 0) return;
      const part = this.parts.push(own) - 1;
      for (let row = 0; row < own.body.length; ++row) {
        found.push({body: own.body[row], begin: own.begin[row], end: own.end[row], number, part, row});
      }
    });
    found.sort((a, b) => a.begin - b.begin);
    for (const {body, begin, end, number, part, row} of found) {
      const track = this.tracks[body];
      track.begins.push(begin);
      track.ends.push(end);
      track.kinds.push(number);
      track.parts.push(part);
      track.rows.push(row);
      this.end = Math.max(this.end, end);
    }
  }

  #pair(row) {
    const name = `${row.a}-${row.b}`;
    let pair = this.pairs.get(name);
    if (!pair) this.pairs.set(name, (pair = new Pair(row)));
    return pair;
  }

  // Returns the first contact of a group, with the group of the pair before it.
  #addContact(contact) {
    const pair = this.#pair(contact);
    const last = pair.contacts.at(-1);
    if (last?.begin === contact.begin) {
      last.rows.push(contact);
      return undefined;
    }
    pair.contacts.push({begin: contact.begin, end: contact.end, rows: [contact]});
    return {contact, last};
  }

  segmentAt(body, t) {
    return segmentAt(this.tracks[body.number], t);
  }
}
