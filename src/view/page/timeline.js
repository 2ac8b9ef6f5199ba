// SPDX-License-Identifier: BSD-3-Clause
// The time axis: committed steps, impacts, marks. Click or drag to go to a time, scroll to zoom,
// double click to see all.

const kMarkColors = {stalled: '--mark', undecided: '--impact', too_near: '--mark',
                     crossed: '--impact', asleep: '--dim', woke: '--proven'};

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
      if (event.buttons & 1) seek(this.#snapped(timeAt(event)));
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

  draw(t) {
    this.t = t;
    const {canvas, run} = this;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (width === 0) return;
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    canvas.setAttribute('aria-valuemin', run.begin);
    canvas.setAttribute('aria-valuemax', run.end);
    canvas.setAttribute('aria-valuenow', t);
    canvas.setAttribute('aria-valuetext', `t = ${t}`);
    const style = getComputedStyle(document.documentElement);
    const color = (name) => style.getPropertyValue(name).trim();
    const pen = canvas.getContext('2d');
    pen.scale(ratio, ratio);
    const [begin, end] = this.#seen();
    const x = (time) => ((time - begin) / (end - begin)) * width;
    const column = (time) => Math.round(x(time));
    const bar = 16;
    const top = 16;

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

    // The bracket [t_safe, t_hit], if it is wide enough to be seen, and the impacts.
    const {rows} = run.impacts;
    pen.fillStyle = color('--impact');
    let previous;
    for (let k = Math.max(0, run.impacts.at(begin)); k < rows.length && rows[k].t <= end; ++k) {
      const impact = rows[k];
      if (Number.isFinite(impact.t_hit)) {
        pen.globalAlpha = 0.3;
        pen.fillRect(x(impact.t_safe), top, x(impact.t_hit) - x(impact.t_safe), bar);
        pen.globalAlpha = 1;
      }
      if (column(impact.t) === previous) continue;
      previous = column(impact.t);
      pen.fillRect(previous - 0.75, top - 3, 1.5, bar + 3);
    }
    // Where pairs come into contact without an impact: shorter lines.
    previous = undefined;
    pen.globalAlpha = 0.55;
    for (const touch of run.touches) {
      if (touch.t < begin || touch.t > end || column(touch.t) === previous) continue;
      previous = column(touch.t);
      pen.fillRect(previous - 0.75, top, 1.5, 0.5 * bar);
    }
    pen.globalAlpha = 1;
    // Marks, as triangles above the bar.
    previous = new Set();
    for (const mark of run.marks) {
      if (!(mark.kind in kMarkColors) || mark.t < begin || mark.t > end) continue;
      const name = `${column(mark.t)} ${mark.kind}`;
      if (previous.has(name)) continue;
      previous.add(name);
      pen.fillStyle = color(kMarkColors[mark.kind]);
      const at = x(mark.t);
      pen.beginPath();
      pen.moveTo(at, top - 2);
      pen.lineTo(at - 4, top - 9);
      pen.lineTo(at + 4, top - 9);
      pen.fill();
    }
    this.#ticks(pen, begin, end, x, width, height, color('--dim'));
    pen.fillStyle = color('--accent');
    const now = Math.min(Math.max(x(t), 0), width);
    pen.fillRect(now - 1, 2, 2, top + bar + 2);
    pen.beginPath();
    pen.arc(now, top + bar / 2, 5, 0, 7);
    pen.fill();
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
