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
  force: {words: 'contact force', rows: (run, body) => forces(run, body, run.contacts.rows)},
  gap: {words: 'gap to', rows: (run, a, b) => gaps(run, a, b), isOfPair: true},
};

// The sum of impulses on a body in a frame, divided by its length; `contacts` are all that are known.
function forces(run, {number}, contacts) {
  const sums = new Map(run.frames.rows.map(({end}) => [end, [0, 0, 0]]));
  const lengths = new Map(run.frames.rows.map(({begin, end}) => [end, end - begin]));
  for (const {a, b, end, impulse} of contacts) {
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

function titleOf(key, body, other) {
  const {words, isOfPair} = kQuantities[key];
  return isOfPair ? `${body.name}: ${words} ${other.name}` : `${body.name}: ${words}`;
}

function sampleTimes(run) {
  const count = Math.min(kMostSamples, Math.max(2, 4 * run.steps.rows.length));
  return Array.from({length: count}, (_, k) => run.begin + ((run.end - run.begin) * k) / (count - 1));
}

// Title and columns [t, value] of a chart of the user's; `other` is for pairs.
export function ownChart(run, key, body, other) {
  const {get, rows} = kQuantities[key];
  const title = titleOf(key, body, other);
  if (rows) {
    const found = rows(run, body, other);
    return {title, data: [found.map(([t]) => t), found.map(([, value]) => value)]};
  }
  const times = sampleTimes(run);
  return {title, data: [times, times.map((t) => (run.isPresent(body, t) ? get(run, body, t) : null))]};
}

// The same of a large run, whose chunks are read one after another.
export async function ownChartOfLarge(run, key, body, other) {
  const {get} = kQuantities[key];
  const found = new Map();
  const contacts = [];
  const times = sampleTimes(run);
  const isOwn = ({a, b}) => a === body.number || b === body.number;
  await run.visitAll((begin, end, store) => {
    if (key === 'force') {
      for (const pair of store.pairs.values()) {
        if (!isOwn(pair)) continue;
        for (const group of pair.contacts) if (group.begin >= begin) contacts.push(...group.rows);
      }
    } else if (key === 'gap') {
      for (const [t, value] of gaps(store, body, other)) found.set(t, value);
    } else {
      for (const t of times) {
        if (t >= begin && t <= end) found.set(t, run.isPresent(body, t) ? get(run, body, t) : null);
      }
    }
  });
  if (key === 'gap') for (const [t, value] of gaps(run, body, other)) found.set(t, value);  // measured besides
  const rows = key === 'force' ? forces(run, body, contacts) : [...found].sort(([s], [t]) => s - t);
  return {title: titleOf(key, body, other), data: [rows.map(([t]) => t), rows.map(([, value]) => value)]};
}
