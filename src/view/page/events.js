// SPDX-License-Identifier: BSD-3-Clause
// The list of what happened: follows the time, can be searched and filtered, and has rows only where it
// is looked at. Also what was worst: the largest impulse, the nearest gap, the longest solve.
import {element} from './element.js';
import {shortNumber} from './curves.js';
import {timeText} from './timeline.js';
import {VirtualList} from './virtual_list.js';

export const kKindNames = {impact: 'impacts', touch: 'first touches', asleep: 'falls asleep', woke: 'wakes',
                           stalled: 'stalls', undecided: 'undecided', too_near: 'nearer than target',
                           parted: 'apart again', placed: 'put elsewhere', crossed: 'crossed', sensor: 'sensors', status: 'changes of status',
                           unconverged: 'solves above tolerance', end: 'end'};
const kOrders = {time: 'in order of time', size: 'largest impulse first', gap: 'smallest gap first'};

const impulseOf = ({hits = []}) => hits.reduce((sum, {impulse}) => Math.max(sum, Math.hypot(...impulse)), 0);

// Merges marks of one kind at one time, such as bodies that fall asleep together.
function merged(marks) {
  const found = new Map();
  for (const mark of marks) {
    const name = `${mark.t} ${mark.kind}`;
    const same = found.get(name);
    if (same) {
      same.more += 1;
      same.bodies = [...same.bodies, ...mark.bodies];
    } else {
      found.set(name, {...mark, more: 0});
    }
  }
  return [...found.values()].map(({more, ...mark}) => ({...mark, text: more > 0 ? `${mark.text} and ${more} more` : mark.text}));
}

// Why a step's contact solves count as coarse.
const roughWords = ({unconverged, residual}) =>
  `${unconverged} contact ${unconverged === 1 ? 'solve' : 'solves'} ended above the tolerance, residual ${shortNumber(residual)}`;

export function eventsOf(run) {
  const name = (number) => run.bodies[number]?.name ?? '?';
  return [
    ...run.impacts.rows.map((impact) => ({
      t: impact.t, kind: 'impact', bodies: [impact.a, impact.b], impact, size: impulseOf(impact), gap: impact.upper,
      text: `${name(impact.a)} meets ${name(impact.b)}`})),
    ...run.touches.map(({t, a, b}) => ({t, kind: 'touch', bodies: [a, b], text: `${name(a)} touches ${name(b)}`})),
    ...merged(run.marks),
    ...run.roughFrames.map((frame) => ({t: frame.end, kind: 'unconverged', bodies: [], text: roughWords(frame)})),
  ].sort((a, b) => a.t - b.t);
}

// What a user looks for first; each with the time and, if it is one, the impact.
export function worstOf(run) {
  const found = [];
  const most = (rows, get) => rows.reduce((best, row) => (get(row) > (best ? get(best) : -Infinity) ? row : best), undefined);
  const impact = most(run.impacts.rows.filter(({hits}) => hits), impulseOf);
  if (impact) found.push({words: 'Largest impulse', value: impulseOf(impact), t: impact.t, impact});
  const gap = most(run.gaps.rows.filter(({upper}) => Number.isFinite(upper)), ({upper}) => -upper);
  if (gap) found.push({words: 'Nearest gap', value: gap.upper, t: gap.t});
  const longest = most(run.frames.rows, ({substeps, rounds}) => (substeps ?? 0) + (rounds ?? 0));
  if (run.charts.length === 0 && longest?.rounds + longest?.substeps > 0) {
    found.push({words: 'Longest solve', value: longest.rounds + longest.substeps, unit: 'rounds and substeps', t: longest.end});
  }
  const rough = most(run.roughFrames, ({residual}) => residual);
  if (rough) found.push({words: 'Largest residual', value: rough.residual, t: rough.end});
  return found;
}

export class EventList {
  // `act` has seek(t) and chooseImpact(number).
  constructor(host, run, act) {
    this.host = host;
    this.run = run;
    this.act = act;
    this.filter = {text: '', kind: '', order: 'time'};
    this.shown = [];
  }

  #choose(event) {
    if (!event) return;
    if (event.impact) this.act.chooseImpact(event.impact.number);
    else this.act.seek(event.t);
  }

  #build() {
    const select = (label, options, key) => element('select', {'aria-label': label, onchange: (event) => {
      this.filter[key] = event.target.value;
      this.#apply();
    }}, ...options.map(([value, words]) => element('option', {value}, words)));
    this.search = element('input', {type: 'search', placeholder: 'Search, such as the name of a body', 'aria-label': 'Search events',
                                    oninput: () => {
                                      this.filter.text = this.search.value.toLowerCase();
                                      this.#apply();
                                    }});
    this.kinds = select('Kind of event', [['', 'all kinds']], 'kind');
    this.orders = select('Order', Object.entries(kOrders), 'order');
    this.count = element('p', {class: 'dim', 'aria-live': 'polite'});
    this.worst = element('div', {class: 'worst'});
    this.list = new VirtualList('Events', (event, place) => this.#row(event, place),
                                {role: 'listbox', onkeydown: (event) => this.#key(event)});
    this.host.replaceChildren(this.worst, element('div', {class: 'filters'}, this.search, this.kinds, this.orders),
                              this.count, this.list.node);
  }

  #refill() {
    this.all = eventsOf(this.run);
    const kinds = [...new Set(this.all.map(({kind}) => kind))];
    this.kinds.replaceChildren(element('option', {value: ''}, 'all kinds'),
                               ...kinds.map((kind) => element('option', {value: kind}, kKindNames[kind] ?? kind)));
    this.kinds.value = kinds.includes(this.filter.kind) ? this.filter.kind : '';
    this.worst.replaceChildren(...worstOf(this.run).map(({words, value, unit, t, impact}) =>
      element('button', {title: `at t = ${t}`, onclick: () => this.#choose({t, impact})},
              `${words}: ${shortNumber(value)}${unit ? ` ${unit}` : ''}`)));
    this.#apply();
  }

  #apply() {
    const {text, kind, order} = this.filter;
    const names = (event) => event.bodies.map((number) => this.run.bodies[number]?.name ?? '').join(' ');
    this.shown = this.all.filter((event) => (kind === '' || event.kind === kind) &&
      (text === '' || `${event.text} ${names(event)}`.toLowerCase().includes(text)));
    if (order === 'size') this.shown = this.shown.filter(({size}) => size > 0).sort((a, b) => b.size - a.size);
    if (order === 'gap') this.shown = this.shown.filter(({gap}) => Number.isFinite(gap)).sort((a, b) => a.gap - b.gap);
    const {length} = this.shown;
    this.count.textContent = length === this.all.length ? `${length} events` : `${length} of ${this.all.length} events`;
    this.list.set(this.shown);
    this.now = undefined;
    this.#follow();
    this.#draw();
  }

  // The last event at or before t, in order of time.
  #nowAt() {
    if (this.filter.order !== 'time') return this.shown.findIndex(({impact}) => impact && impact === this.impact);
    let low = 0;
    let high = this.shown.length;
    while (low < high) {
      const middle = (low + high) >>> 1;
      if (this.shown[middle].t <= this.t) low = middle + 1;
      else high = middle;
    }
    return low - 1;
  }

  // Scrolls so that the event of now stays in sight.
  #follow() {
    const now = this.#nowAt();
    if (now === this.now) return false;
    this.now = now;
    this.list.reveal(now);
    return true;
  }

  #row(event, place) {
    const color = this.run.stateColor(event);
    const extra = event.size > 0 ? shortNumber(event.size) : '';
    const row = element('div', {class: 'row', role: 'option', id: `event-${place}`, 'aria-selected': String(place === this.now),
                                onclick: () => this.#choose(event)},
                        element('span', {class: 'when'}, timeText(event.t, this.run.end - this.run.begin)),
                        element('span', {class: `dot ${event.kind}`, style: color && `background: ${color}`}),
                        element('span', {class: 'what', title: event.text}, event.text),
                        element('span', {class: 'dim', title: extra && 'largest impulse'}, extra));
    row.classList.toggle('now', place === this.now);
    return row;
  }

  #draw() {
    this.list.draw();
    if (this.list.isDrawn(this.now)) this.list.node.setAttribute('aria-activedescendant', `event-${this.now}`);
    else this.list.node.removeAttribute('aria-activedescendant');
  }

  #key(event) {
    const move = {ArrowDown: 1, ArrowUp: -1, PageDown: 10, PageUp: -10}[event.key];
    if (!move) return;
    event.preventDefault();
    event.stopPropagation();
    const next = Math.min(Math.max(this.now + move, 0), this.shown.length - 1);
    this.#choose(this.shown[next]);
  }

  show(t, impact) {
    [this.t, this.impact] = [t, impact];
    if (this.host.hidden) return;
    if (!this.list) this.#build();
    const {impacts, marks, touches, roughFrames} = this.run;
    const count = impacts.rows.length + marks.length + touches.length + roughFrames.length;
    if (this.listed !== count) {
      this.listed = count;
      this.#refill();
    } else if (this.#follow()) {
      this.#draw();
    }
  }
}
