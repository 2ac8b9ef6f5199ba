// SPDX-License-Identifier: BSD-3-Clause
// Curves over time: gaps of the nearest pairs with their proven lower bounds, energy, momentum, and
// what the steps cost. Made when first seen.
import uPlot from 'uplot';

const kHues = ['#2563eb', '#d97706', '#2f9e44', '#9333ea', '#d6336c', '#0e7490'];
const kMostPairs = 6;

function leastGaps(run) {
  const pairs = [...run.pairs.values()].filter(({gaps}) => gaps.some((g) => Number.isFinite(g.upper)));
  const least = (pair) => Math.min(...pair.gaps.map((gap) => gap.upper));
  return pairs.map((pair) => ({pair, least: least(pair)})).sort((a, b) => a.least - b.least)
    .slice(0, kMostPairs).map(({pair}) => pair);
}

export function shortNumber(v) {
  if (v == null) return '';
  const size = Math.abs(v);
  return v === 0 || (size >= 1e-3 && size < 1e5) ? Number(v.toPrecision(3)).toString()
    : v.toExponential(1).replace('.0e', 'e').replace('+', '');
}

const number = (u, value) => (value == null ? '–' : value.toPrecision(5));

export class Curves {
  constructor(host, run, seek) {
    this.host = host;
    this.run = run;
    this.seek = seek;
    this.plots = [];
    this.t = run.begin;
  }

  #plot(title, series, data, log = false) {
    const style = getComputedStyle(document.documentElement);
    const color = (name) => style.getPropertyValue(name).trim();
    const axis = {stroke: color('--dim'), grid: {stroke: color('--line'), width: 1},
                  ticks: {stroke: color('--line'), width: 1}, font: '10px system-ui'};
    const section = document.createElement('div');
    section.className = 'curve';
    section.innerHTML = '<h2></h2>';
    section.firstChild.textContent = title;
    this.host.append(section);
    const plot = new uPlot({
      width: Math.max(200, this.host.clientWidth - 26),
      height: 150,
      cursor: {sync: {key: 'time'}, drag: {x: true, y: false}},
      scales: {x: {time: false}, y: log ? {distr: 3, log: 10} : {}},
      axes: [{...axis, size: 26},
             {...axis, size: 62,
              values: (u, ticks) => ticks.map(shortNumber)}],
      series: [{label: 't', value: number}, ...series.map((one) => ({value: number, width: 1.5,
                                                                     points: {show: false}, ...one}))],
      hooks: {draw: [(u) => this.#drawNow(u, color('--accent'))]},
    }, data, section);
    plot.over.addEventListener('click', () => {
      if (plot.cursor.idx != null && plot.select.width === 0) {
        this.seek(plot.posToVal(plot.cursor.left, 'x'));
      }
    });
    this.plots.push(plot);
  }

  #drawNow(u, color) {
    const x = u.valToPos(this.t, 'x', true);
    if (!(x >= u.bbox.left && x <= u.bbox.left + u.bbox.width)) return;
    u.ctx.fillStyle = color;
    u.ctx.fillRect(x - 1, u.bbox.top, 2, u.bbox.height);
  }

  #gaps() {
    const pairs = leastGaps(this.run);
    if (pairs.length === 0) return;
    const times = [...new Set(pairs.flatMap(({gaps}) => gaps.map((gap) => gap.t)))].sort((a, b) => a - b);
    const place = new Map(times.map((t, k) => [t, k]));
    const positive = (x) => (x > 0 && Number.isFinite(x) ? x : null);
    const data = [times];
    const series = [];
    pairs.forEach(({a, b, gaps}, k) => {
      const upper = new Array(times.length).fill(null);
      const lower = new Array(times.length).fill(null);
      for (const gap of gaps) {
        upper[place.get(gap.t)] = positive(gap.upper);
        lower[place.get(gap.t)] = positive(gap.lower);
      }
      const name = `${this.run.bodies[a].name} – ${this.run.bodies[b].name}`;
      data.push(upper, lower);
      series.push({label: name, stroke: kHues[k], spanGaps: false},
                  {label: 'proven', class: 'proven', stroke: kHues[k], dash: [4, 3], spanGaps: false});
    });
    this.#plot('Gap of the nearest pairs (dashed: proven lower bound)', series, data, true);
  }

  #frames() {
    const {rows} = this.run.frames;
    if (rows.length === 0) return;
    const of = (get) => rows.map(get);
    const t = of((f) => f.end);
    this.#plot('Energy', [{label: 'kinetic', stroke: kHues[1]}, {label: 'potential', stroke: kHues[2]},
                          {label: 'sum', stroke: kHues[0], width: 2}],
               [t, of((f) => f.kinetic), of((f) => f.potential),
                of((f) => f.kinetic + f.potential)]);
    this.#plot('Momentum', [{label: '|p|', stroke: kHues[0]}, {label: '|L|', stroke: kHues[3]}],
               [t, of((f) => Math.hypot(...f.momentum)),
                of((f) => Math.hypot(...f.angular_momentum))]);
    this.#plot('Contacts and sub-steps of islands',
               [{label: 'contacts', stroke: kHues[0]}, {label: 'legs', stroke: kHues[1]},
                {label: 'stalls', stroke: kHues[4]}],
               [t, of((f) => f.contacts), of((f) => f.legs), of((f) => f.stalls)]);
    if (rows.some((f) => f.residual > 0)) {
      this.#plot('Residual of the contact solver', [{label: 'residual', stroke: kHues[3]}],
                 [t, of((f) => (f.residual > 0 ? f.residual : null))], true);
    }
  }

  build() {
    for (const plot of this.plots) plot.destroy();
    this.plots = [];
    this.host.replaceChildren();
    this.#gaps();
    this.#frames();
    if (this.plots.length === 0) this.host.textContent = 'Nothing was recorded for curves.';
    this.built = this.run.frames.rows.length;
  }

  update(t) {
    this.t = t;
    if (this.host.hidden) return;
    if (this.built !== this.run.frames.rows.length || this.stale) this.build();
    this.stale = false;
    for (const plot of this.plots) plot.redraw(false, false);
  }
}
