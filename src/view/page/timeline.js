// SPDX-License-Identifier: BSD-3-Clause
// The time axis: committed steps, impacts, marks. Click or drag to go to a time, scroll to zoom,
// double click to see all.

const kMarkColors = {stalled: '--mark', undecided: '--impact', too_near: '--mark', crossed: '--impact',
                     asleep: '--dim', woke: '--proven', status: '--proven', unconverged: '--mark'};
const kBar = {top: 16, height: 16, strip: 4};
const kReach = 4;  // pixels from the pointer to what is meant
const kMostWords = 4;

export const markColor = (kind) => kMarkColors[kind] ?? '--dim';

export function timeText(t, span) {
  const digits = Math.max(0, Math.min(12, 4 - Math.floor(Math.log10(span || 1))));
  return t.toFixed(digits);
}

export class Timeline {
  constructor(canvas, run, seek) {
    this.canvas = canvas;
    this.run = run;
    this.seek = seek;
    this.range = undefined;  // what is seen, if not all
    this.t = run.begin;
    this.tip = document.getElementById('tip');
    const timeAt = (event) => {
      const box = canvas.getBoundingClientRect();
      const [begin, end] = this.#seen();
      return begin + ((event.clientX - box.left) / box.width) * (end - begin);
    };
    canvas.addEventListener('pointerdown', (event) => {
      canvas.setPointerCapture(event.pointerId);
      seek(this.#snapped(timeAt(event)));
    });
    canvas.addEventListener('pointermove', (event) => {
      const t = timeAt(event);
      if (event.buttons & 1) seek(this.#snapped(t));
      this.#showTip(event, t);
    });
    for (const end of ['pointerleave', 'pointercancel']) canvas.addEventListener(end, () => (this.tip.hidden = true));
    canvas.addEventListener('keydown', (event) => {
      const pages = {PageUp: 1, PageDown: -1}[event.key];
      if (!pages) return;
      event.preventDefault();
      const [begin, end] = this.#all();
      seek(this.t + (pages * (end - begin)) / 10);
    });
    canvas.addEventListener('wheel', (event) => {
      event.preventDefault();
      this.#zoom(timeAt(event), Math.exp(event.deltaY / 300));
    }, {passive: false});
    canvas.addEventListener('dblclick', () => {
      this.range = undefined;
      this.draw(this.t);
    });
  }

  #all() {
    const {begin, end, plannedEnd} = this.run;
    const last = this.live ? Math.max(end, plannedEnd) : end;
    return [begin, last > begin ? last : begin + 1];
  }

  #seen() {
    return this.range ?? this.#all();
  }

  #zoom(t, factor) {
    const [begin, end] = this.#seen();
    const all = this.#all();
    const from = Math.max(all[0], t - (t - begin) * factor);
    const to = Math.min(all[1], t + (end - t) * factor);
    const least = 1e-12 * (all[1] - all[0]);
    this.range = to - from < (all[1] - all[0]) * 0.999 && to - from > least ? [from, to]
      : to - from <= least ? this.range : undefined;
    this.draw(this.t);
  }

  // An impact within four pixels is meant.
  #snapped(t) {
    const [begin, end] = this.#seen();
    const reach = (4 * (end - begin)) / Math.max(1, this.canvas.clientWidth);
    const {rows} = this.run.impacts;
    let best;
    for (let k = Math.max(0, this.run.impacts.at(t - reach)); k < rows.length; ++k) {
      if (rows[k].t > t + reach) break;
      const off = Math.abs(rows[k].t - t);
      if (off <= reach && !(off >= Math.abs(best - t))) best = rows[k].t;
    }
    return Math.min(Math.max(best ?? t, this.run.begin), this.run.end);
  }

  // What happened within a few pixels of a time, in words.
  #wordsAt(t) {
    const {run} = this;
    const [begin, end] = this.#seen();
    const reach = (kReach * (end - begin)) / Math.max(1, this.canvas.clientWidth);
    const name = (k) => run.bodies[k]?.name ?? '?';
    const words = [];
    for (let k = run.impacts.at(t - reach) + 1; k < run.impacts.rows.length; ++k) {
      const {t: at, a, b} = run.impacts.rows[k];
      if (at > t + reach) break;
      words.push(`${name(a)} meets ${name(b)}`);
    }
    for (const {t: at, a, b} of run.touches) {
      if (Math.abs(at - t) <= reach) words.push(`${name(a)} touches ${name(b)}`);
    }
    for (const {t: at, text} of run.marks) if (Math.abs(at - t) <= reach) words.push(text);
    const state = run.statusAt(t);
    if (state && !words.includes(state.text)) words.push(state.text);
    const more = words.length - kMostWords;
    return [`t = ${timeText(t, end - begin)}`, ...words.slice(0, kMostWords), ...(more > 0 ? [`and ${more} more`] : [])];
  }

  #showTip(event, t) {
    const {tip, canvas} = this;
    tip.hidden = false;
    tip.replaceChildren(...this.#wordsAt(t).map((line) => {
      const row = document.createElement('div');
      row.textContent = line;
      return row;
    }));
    const box = canvas.getBoundingClientRect();
    const left = Math.min(Math.max(event.clientX - tip.offsetWidth / 2, 4), innerWidth - tip.offsetWidth - 4);
    tip.style.left = `${left}px`;
    tip.style.bottom = `${innerHeight - box.top + 4}px`;
  }

  // Counts how many times, in ascending order, fall into each column of the picture.
  #density(times, count, begin, end, width) {
    const columns = new Uint32Array(Math.ceil(width) + 1);
    let most = 0;
    for (let k = 0; k < count; ++k) {
      const t = times(k);
      if (t < begin || t > end) continue;
      const column = Math.round(((t - begin) / (end - begin)) * width);
      most = Math.max(most, ++columns[column]);
    }
    return {columns, most};
  }

  // Each column is as high as many events fall into it, on a scale of logarithms.
  #drawDensity(pen, {columns, most}, least, thickness) {
    const {top, height} = kBar;
    const scale = Math.log(1 + most);
    columns.forEach((count, column) => {
      if (count === 0) return;
      const part = most === 1 ? 1 : Math.log(1 + count) / scale;
      const tall = least + (height - least) * part;
      pen.fillRect(column - thickness / 2, top + height - tall, thickness, tall);
    });
  }

  // States that last, such as those of a haptic loop: a strip below the bar.
  #drawStates(pen, begin, end, x) {
    const {states} = this.run;
    states.forEach(({t, number}, k) => {
      const until = Math.min(states[k + 1]?.t ?? this.run.end, end);
      if (until < begin || t > end) return;
      pen.fillStyle = this.run.stateColor({text: this.run.stateNames[number]});
      const from = x(Math.max(t, begin));
      pen.fillRect(from, kBar.top + kBar.height - kBar.strip, Math.max(1, x(until) - from), kBar.strip);
    });
  }

  // Steps whose contact solves ended above their tolerance.
  #drawUnconverged(pen, begin, end, x, color) {
    pen.fillStyle = color;
    for (const frame of this.run.roughFrames) {
      if (frame.end < begin || frame.begin > end) continue;
      pen.fillRect(x(frame.begin), kBar.top + kBar.height - 3, Math.max(1.5, x(frame.end) - x(frame.begin)), 3);
    }
  }

  // The rarest lie on top.
  #drawMarks(pen, begin, end, x, color) {
    const {top} = kBar;
    const byFill = new Map();  // places, in pixels
    for (const mark of this.run.marks) {
      if (mark.t < begin || mark.t > end) continue;
      const fill = this.run.stateColor(mark) ?? color(markColor(mark.kind));
      if (!byFill.has(fill)) byFill.set(fill, []);
      byFill.get(fill).push(x(mark.t));
    }
    for (const [fill, places] of [...byFill].sort(([, a], [, b]) => b.length - a.length)) {
      pen.fillStyle = fill;
      let last = -Infinity;
      for (const at of places) {
        if (at - last < 2) continue;
        last = at;
        pen.beginPath();
        pen.moveTo(at, top - 2);
        pen.lineTo(at - 4, top - 9);
        pen.lineTo(at + 4, top - 9);
        pen.fill();
      }
    }
  }

  draw(t, isSpoken = true) {
    this.t = t;
    const {canvas, run} = this;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (width === 0) return;
    if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
    if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
    if (isSpoken) this.#speak(t);
    const style = getComputedStyle(document.documentElement);
    const color = (name) => style.getPropertyValue(name).trim();
    const pen = canvas.getContext('2d');
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    const [begin, end] = this.#seen();
    const x = (time) => ((time - begin) / (end - begin)) * width;
    const column = (time) => Math.round(x(time));
    const {top, height: bar} = kBar;

    pen.fillStyle = color('--line');
    pen.fillRect(0, top, width, bar);
    pen.fillStyle = color('--dim');
    pen.globalAlpha = 0.35;
    pen.fillRect(x(run.begin), top, x(run.end) - x(run.begin), bar);
    // Committed steps, while there is space between them.
    const steps = run.steps;
    const first = Math.max(0, steps.at(begin));
    const last = steps.at(end);
    if (last - first < width / 3) {
      pen.fillStyle = color('--text');
      for (let k = first; k <= last; ++k) pen.fillRect(column(steps.rows[k].end), top + bar - 5, 1, 5);
    }
    pen.globalAlpha = 1;
    this.#drawBrackets(pen, begin, end, x, color('--impact'));
    // Where pairs come into contact without an impact are paler lines.
    pen.fillStyle = color('--impact');
    pen.globalAlpha = 0.35;
    const touches = this.#density((k) => run.touches[k].t, run.touches.length, begin, end, width);
    this.#drawDensity(pen, touches, 0.4 * bar, 1.5);
    pen.globalAlpha = 1;
    const rows = run.impacts.rows;
    const hits = this.#density((k) => rows[k].t, rows.length, begin, end, width);
    this.#drawDensity(pen, hits, 0.5 * bar, 1.5);
    this.#drawStates(pen, begin, end, x);
    this.#drawUnconverged(pen, begin, end, x, color('--mark'));
    this.#drawMarks(pen, begin, end, x, color);
    this.#ticks(pen, begin, end, x, width, height, color('--dim'));
    pen.fillStyle = color('--accent');
    const now = Math.min(Math.max(x(t), 0), width);
    pen.fillRect(now - 1, 2, 2, top + bar + 2);
    pen.beginPath();
    pen.arc(now, top + bar / 2, 5, 0, 7);
    pen.fill();
  }

  // The bracket [t_safe, t_hit] of an impact, if it is wide enough to be seen.
  #drawBrackets(pen, begin, end, x, color) {
    const {rows} = this.run.impacts;
    pen.fillStyle = color;
    pen.globalAlpha = 0.3;
    for (let k = Math.max(0, this.run.impacts.at(begin)); k < rows.length && rows[k].t <= end; ++k) {
      const {t_safe: safe, t_hit: hit} = rows[k];
      const wide = x(hit) - x(safe);
      if (wide > 0.5) pen.fillRect(x(safe), kBar.top, wide, kBar.height);
    }
    pen.globalAlpha = 1;
  }

  // For those who hear the page; while it plays it says nothing.
  #speak(t) {
    const {canvas, run} = this;
    canvas.setAttribute('aria-valuemin', run.begin);
    canvas.setAttribute('aria-valuemax', run.end);
    canvas.setAttribute('aria-valuenow', t);
    canvas.setAttribute('aria-valuetext', `t = ${timeText(t, run.end - run.begin)}`);
  }

  #ticks(pen, begin, end, x, width, height, color) {
    pen.fillStyle = color;
    pen.font = '10px system-ui, sans-serif';
    pen.textBaseline = 'bottom';
    const wanted = (end - begin) / Math.max(2, width / 90);
    const power = 10 ** Math.floor(Math.log10(wanted));
    const step = [1, 2, 5, 10].map((f) => f * power).find((s) => s >= wanted);
    const digits = Math.max(0, Math.min(15, -Math.floor(Math.log10(step) + 1e-9)));
    for (let k = Math.ceil(begin / step); k * step <= end; ++k) {
      const text = (k * step).toFixed(digits);
      const at = Math.min(Math.max(x(k * step) - pen.measureText(text).width / 2, 0),
                          width - pen.measureText(text).width);
      pen.fillText(text, at, height);
    }
  }
}
