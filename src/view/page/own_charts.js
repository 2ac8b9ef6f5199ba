// SPDX-License-Identifier: BSD-3-Clause
// Charts that a user asks for: a number of one body, or of a pair, over time.

const kMostSamples = 1500;

const axis = (k) => (run, body, t) => run.centerOf(body, t)[k];

// Each has words, and get(run, body, t), or rows(run, a, b) for what is recorded at its own times.
export const kQuantities = {
  x: {words: 'position x', get: axis(0)},
  y: {words: 'position y', get: axis(1)},
  z: {words: 'position z', get: axis(2)},
  speed: {words: 'speed', get: (run, body, t) => Math.hypot(...run.state(body, t).v)},
  spin: {words: 'angular speed', get: (run, body, t) => Math.hypot(...run.state(body, t).w)},
  energy: {words: 'energy of its speed', get: (run, body, t) => ((body.mass ?? 0) / 2) * Math.hypot(...run.state(body, t).v) ** 2},
  force: {words: 'contact force', rows: (run, body) => forces(run, body)},
  gap: {words: 'gap to', rows: (run, a, b) => gaps(run, a, b), isOfPair: true},
};

// The sum of impulses on a body in a frame, divided by its length.
function forces(run, {number}) {
  const sums = new Map(run.frames.rows.map(({end}) => [end, [0, 0, 0]]));
  const lengths = new Map(run.frames.rows.map(({begin, end}) => [end, end - begin]));
  for (const {a, b, end, impulse} of run.contacts.rows) {
    if (a !== number && b !== number) continue;
    const sum = sums.get(end);
    if (sum) impulse.forEach((x, k) => (sum[k] += b === number ? x : -x));
  }
  return [...sums].map(([t, sum]) => [t, Math.hypot(...sum) / (lengths.get(t) || 1)]);
}

function gaps(run, a, b) {
  const pair = run.pairs.get(`${a.number}-${b.number}`) ?? run.pairs.get(`${b.number}-${a.number}`);
  return (pair?.gaps ?? []).map(({t, lower, upper}) => [t, Number.isFinite(upper) ? upper : lower]);
}

// Title and columns [t, value] of a chart of the user's; `other` is for pairs.
export function ownChart(run, key, body, other) {
  const {words, get, rows, isOfPair} = kQuantities[key];
  const title = isOfPair ? `${body.name}: ${words} ${other.name}` : `${body.name}: ${words}`;
  if (rows) {
    const found = rows(run, body, other);
    return {title, data: [found.map(([t]) => t), found.map(([, value]) => value)]};
  }
  const count = Math.min(kMostSamples, Math.max(2, 4 * run.steps.rows.length));
  const times = Array.from({length: count}, (_, k) => run.begin + ((run.end - run.begin) * k) / (count - 1));
  return {title, data: [times, times.map((t) => (run.isPresent(body, t) ? get(run, body, t) : null))]};
}
