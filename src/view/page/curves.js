// SPDX-License-Identifier: BSD-3-Clause
// Curves over time: gaps of the nearest pairs with their proven lower bounds, energy, momentum, and
// what the steps cost. Made when first seen.
import uPlot from 'uplot';
import {element} from './element.js';
import {saveChart} from './export.js';
import {differenceCurve} from './compare.js';
import {kQuantities, ownChart, ownChartOfLarge} from './own_charts.js';
import {lastAtMost} from './store.js';

const kHues = {light: ['#2563eb', '#d97706', '#2f9e44', '#9333ea', '#d6336c', '#0e7490'],
               dark: ['#7aa7ff', '#fbbf6b', '#6fd08c', '#c59bff', '#ff8fb5', '#5fd0e0']};
const kMostPairs = 6;

function leastGaps(run) {
  const pairs = [...run.pairs.values()].filter(({gaps}) => gaps.some((g) => Number.isFinite(g.upper)));
  const least = (pair) => Math.min(...pair.gaps.map((gap) => gap.upper));
  return pairs.map((pair) => ({pair, least: least(pair)})).sort((a, b) => a.least - b.least)
    .slice(0, kMostPairs).map(({pair}) => pair);
}

export function shortNumber(v, digits = 3) {
  if (v == null) return '';
  const size = Math.abs(v);
  return v === 0 || (size >= 1e-3 && size < 1e5) ? Number(v.toPrecision(digits)).toString()
    : v.toExponential(digits - 2).replace(/\.?0*e/, 'e').replace('+', '');
}

const number = (u, value) => (value == null ? '–' : shortNumber(value, 5));

export class Curves {
  constructor(host, run, seek, redraw) {
    this.redraw = redraw;
    this.own = [];  // {key, body, other}: charts that the user has asked for
    this.host = host;
    this.run = run;
    this.seek = seek;
    this.plots = [];
    this.t = run.begin;
  }

  // `bands` are pairs of series between which the plot is filled.
  #plot(title, series, data, {log = false, bands, buttons = []} = {}) {
    const style = getComputedStyle(document.documentElement);
    const color = (name) => style.getPropertyValue(name).trim();
    const line = {stroke: color('--line'), width: 1};
    // Lines and numbers at powers of ten only.
    const decades = (u, ticks) => ticks.map((v) => (Math.abs(Math.log10(v) % 1) < 1e-6 ? v : null));
    const filter = log ? {filter: decades} : {};
    const axis = {stroke: color('--dim'), grid: line, ticks: line, font: '10px system-ui'};
    const section = document.createElement('div');
    section.className = 'curve';
    const names = ['t', ...series.map(({label}) => label)];
    section.append(element('div', {class: 'head'}, element('h2', {}, title), ...buttons,
                           element('button', {class: 'plain', title: 'Save the numbers as CSV', 'aria-label': `Save ${title} as CSV`,
                                              onclick: () => saveChart(title, names, data)}, 'CSV')));
    this.host.append(section);
    const plot = new uPlot({
      width: Math.max(200, this.host.clientWidth - 26),
      height: 150,
      cursor: {sync: {key: 'time'}, drag: {x: true, y: false}},
      scales: {x: {time: false}, y: log ? {distr: 3, log: 10} : {}},
      axes: [{...axis, size: 26},
             {...axis, size: 62, grid: {...line, ...filter}, ticks: {...line, ...filter}, ...filter,
              values: (u, ticks) => ticks.map((v) => shortNumber(v))}],
      bands,
      series: [{label: 't', class: 'time', value: number}, ...series.map((one) => ({value: number, width: 1.5,
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
    const bands = [];
    pairs.forEach(({a, b, gaps}, k) => {
      const upper = new Array(times.length).fill(null);
      const lower = new Array(times.length).fill(null);
      for (const gap of gaps) {
        upper[place.get(gap.t)] = positive(gap.upper);
        lower[place.get(gap.t)] = positive(gap.lower);
      }
      const name = `${this.run.gapName(a)} – ${this.run.gapName(b)}`;
      data.push(upper, lower);
      series.push({label: name, stroke: this.hues[k], spanGaps: false},
                  {label: 'proven', class: 'proven', stroke: this.hues[k], width: 0.5, spanGaps: false});
      bands.push({series: [2 * k + 1, 2 * k + 2], fill: `${this.hues[k]}40`});
    });
    this.#plot('Gap of the nearest pairs, shaded down to the proven bound', series, data,
               {log: true, bands});
  }

  #frames() {
    const {rows} = this.run.frames;
    if (rows.length === 0 || this.run.charts.length > 0) return;
    const of = (get) => rows.map(get);
    const t = of((f) => f.end);
    this.#plot('Energy', [{label: 'kinetic', stroke: this.hues[1]}, {label: 'potential', stroke: this.hues[2]},
                          {label: 'sum', stroke: this.hues[0], width: 2}],
               [t, of((f) => f.kinetic), of((f) => f.potential),
                of((f) => f.kinetic + f.potential)]);
    this.#plot('Momentum', [{label: '|p|', stroke: this.hues[0]}, {label: '|L|', stroke: this.hues[3]}],
               [t, of((f) => Math.hypot(...f.momentum)),
                of((f) => Math.hypot(...f.angular_momentum))]);
    this.#plot('Contacts and sub-steps of islands',
               [{label: 'contacts', stroke: this.hues[0]}, {label: 'substeps', stroke: this.hues[1]},
                {label: 'stalls', stroke: this.hues[4]}],
               [t, of((f) => f.contacts), of((f) => f.substeps), of((f) => f.stalls)]);
    if (rows.some((f) => f.residual > 0)) {
      this.#plot('Residual of the contact solver', [{label: 'residual', stroke: this.hues[3]}],
                 [t, of((f) => (f.residual > 0 ? f.residual : null))], {log: true});
    }
  }

  // What a run that is not a World's brings with it.
  #charts() {
    const {rows} = this.run.samples;
    if (rows.length === 0) return;
    const t = rows.map((row) => row.t);
    let column = 0;
    for (const {title, series} of this.run.charts) {
      const lines = series.map((label, k) => ({label, stroke: this.hues[k]}));
      this.#plot(title, lines, [t, ...series.map(() => {
        const name = String(column++);
        return rows.map((row) => row[name]);
      })]);
    }
  }

  // Where a chart is asked for: of a number of a body, or of the gap of a pair.
  #form() {
    const {bodies, movers} = this.run;
    const first = (this.wanted ??= {key: 'speed', body: movers[0]?.number ?? 0, other: 0});
    const pick = (label, name, options) => {
      const node = element('select', {'aria-label': label, onchange: () => {
        first[name] = name === 'key' ? node.value : Number(node.value);
        other.hidden = !kQuantities[first.key].isOfPair;
      }}, ...options.map(([value, words]) => element('option', {value: String(value)}, words)));
      node.value = String(first[name]);
      return node;
    };
    const names = bodies.map(({name, number}) => [number, name]);
    const key = pick('Quantity', 'key', Object.entries(kQuantities).map(([name, {words}]) => [name, words]));
    const body = pick('Body', 'body', names);
    const other = pick('Other body', 'other', names);
    other.hidden = !kQuantities[first.key].isOfPair;
    const add = element('button', {onclick: () => this.add(first.key, bodies[first.body], bodies[first.other])}, 'Add chart');
    return element('div', {class: 'filters'}, body, key, other, add);
  }

  add(key, body, other) {
    const one = {key, body, other};
    this.own.unshift(one);
    this.stale = true;
    this.redraw();
    if (!this.run.isLarge) return undefined;
    one.chart = {title: 'Reading the whole run', data: [[]]};
    return ownChartOfLarge(this.run, key, body, other).then((chart) => {
      one.chart = chart;
      this.stale = true;
      this.redraw();
    });
  }

  #ownCharts() {
    this.own.forEach((one, k) => {
      const {title, data} = one.chart ?? ownChart(this.run, one.key, one.body, one.other);
      const remove = element('button', {class: 'plain', 'aria-label': `Remove ${title}`, title: 'Remove', onclick: () => {
        this.own.splice(k, 1);
        this.stale = true;
        this.redraw();
      }}, '✕');
      if (data[0].length > 0) {
        this.#plot(title, [{label: kQuantities[one.key].words, stroke: this.hues[k % this.hues.length]}], data, {buttons: [remove]});
      } else {
        this.host.append(element('div', {class: 'head'}, element('h2', {}, one.chart?.data[0].length === 0 && one.chart.data.length === 1 ? title : `${title}: not recorded`), remove));
      }
    });
  }

  build() {
    for (const plot of this.plots) plot.destroy();
    this.plots = [];
    this.hues = kHues[document.documentElement.dataset.theme === 'dark' ? 'dark' : 'light'];
    this.host.replaceChildren(this.#form());
    this.#ownCharts();
    if (this.other) {
      this.#plot('Difference of the two runs, largest of all bodies', [
        {label: 'distance', stroke: this.hues[0]}, {label: 'turn in radians', stroke: this.hues[1]},
      ], this.difference ??= differenceCurve(this.run, this.other), {log: true});
    }
    this.#gaps();
    this.#frames();
    this.#charts();
    if (this.plots.length === 0) this.host.append(element('p', {class: 'dim'}, 'Nothing was recorded for curves.'));
    this.built = this.run.frames.rows.length;
    queueMicrotask(() => this.#showNow());  // after the plots have drawn themselves first
  }

  update(t) {
    this.t = t;
    if (this.host.hidden) return;
    if (this.built !== this.run.frames.rows.length || this.stale) this.build();
    this.stale = false;
    this.#showNow();
  }

  // The line at the time shown, and the values there.
  #showNow() {
    for (const plot of this.plots) {
      const idx = lastAtMost(plot.data[0], plot.data[0].length, this.t);
      if (plot.cursor.left < 0) plot.setLegend({idx: Math.max(0, idx)}, false);
      plot.redraw(false, false);
    }
  }
}
