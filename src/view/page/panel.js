// SPDX-License-Identifier: BSD-3-Clause
// The panel beside the picture: data of what is chosen, lists of events and bodies.
import {BodyTree} from './bodies.js';
import {element} from './element.js';
import {EventList} from './events.js';
import {tiesOf} from './links.js';

// Nine digits; with an exponent where zeros would have to be counted.
function digits(x, count) {
  const size = Math.abs(x);
  if (x === 0 || (size >= 1e-3 && size < 1e9)) return Number(x.toPrecision(count)).toString();
  return x.toExponential(count - 1).replace(/\.?0*e/, 'e').replace('+', '');
}

function number(x) {
  if (x === undefined) return '–';
  if (Number.isNaN(x)) return 'not known';
  if (x === Infinity) return 'not computed';
  return digits(x, 9);
}

const strongest = (hits) => [...hits].sort((a, b) => Math.hypot(...b.impulse) - Math.hypot(...a.impulse));

const vector = (v) => v.map((x) => digits(x, 6)).join(', ');

// A line does not end within a number like 1.8e-16.
function unbroken(value) {
  if (typeof value !== 'string') return [value];
  return value.split(/(\S*\de-\d\S*)/).map((part, k) => (k % 2 === 1 ? element('span', {class: 'unbroken'}, part) : part));
}

function rows(list) {
  return element('table', {}, ...list.filter(Boolean).map(([name, value]) =>
    element('tr', {}, element('th', {}, name), element('td', {}, ...unbroken(value)))));
}

const kMostNeighbours = 6;
const kMostProofs = 12;
const kKindWords = {dynamic: 'moved by forces', kinematic: 'on a given motion', static: 'fixed'};

// How the distance of a pair over the last step was proven, as ProofKind + 1.
const kProofWords = ['', 'their bounds leave room', 'a time-of-impact query', 'neither body moved',
                     'not proven: it began nearer than its target'];

export class Panel {
  // `act` has seek(t), chooseBody(body), chooseImpact(k), and what bodies.js asks for.
  constructor(run, act) {
    this.run = run;
    this.act = act;
    this.host = Object.fromEntries(['data', 'events', 'bodies'].map(
      (name) => [name, document.getElementById(`tab-${name}`)]));
    this.events = new EventList(this.host.events, run, act);
    this.bodies = new BodyTree(this.host.bodies, run, act);
  }

  name(number) {
    return this.run.bodies[number]?.name ?? '?';
  }

  // How far the bodies are apart that are near this one, from the nearest.
  #neighbours({number: own}, t) {
    const side = this.run.sideOf(own);
    return this.run.gapsAt(t).filter(({a, b}) => side.includes(a) || side.includes(b))
      .sort((x, y) => Math.min(x.upper, x.lower) - Math.min(y.upper, y.lower)).slice(0, kMostNeighbours)
      .map(({a, b, lower, upper, proof}, k) => [k === 0 ? 'Gap to' : '',
        `${this.run.gapName(side.includes(a) ? b : a)}: ${Number.isFinite(upper) ? `${number(upper)}, proven ` : 'at least '}${number(lower)}` +
        (kProofWords[proof] ? ` (${kProofWords[proof]})` : '')]);
  }

  #body(body, t) {
    const {p, q, v, w} = this.run.state(body, t);
    const touching = this.run.contactsAt(t).filter(({a, b}) => a === body.number || b === body.number);
    return [
      element('h2', {}, body.name),
      rows([
        ['Kind', kKindWords[body.kind]],
        body.shape_name && ['Shape', body.shape_name],
        ['Triangles drawn', (this.run.surfaces[body.shape].indices.length / 3).toLocaleString('en')],
        body.mass !== undefined && ['Mass', number(body.mass)],
        ['Position', vector(p)],
        ['Quaternion x y z w', vector(q)],
        ['Velocity', vector(v)],
        ['Angular velocity', vector(w)],
        ['Speed', number(Math.hypot(...v))],
        body.kind === 'dynamic' && ['Sleeps', this.run.isAsleep(body, t) ? 'yes' : 'no'],
        ['Contacts', String(touching.length)],
        ...this.#neighbours(body, t),
        ...tiesOf(this.run, body).map((words, k) => [k === 0 ? 'Tied by' : '', words]),
      ]),
    ];
  }

  #impact(impact) {
    const width = impact.t_hit - impact.t_safe;
    return [
      element('h2', {}, `Impact ${impact.number + 1}: ${this.name(impact.a)} meets ${this.name(impact.b)}`),
      rows([
        ['Time', String(impact.t)],
        ['Proven apart until', String(impact.t_safe)],
        ['Reached by', Number.isNaN(impact.t_hit) ? 'not known' : String(impact.t_hit)],
        Number.isFinite(width) && ['Width of the bracket', number(width)],
        ['Gap at least', number(impact.lower)],
        ['Gap at most', number(impact.upper)],
        ['Closing speed', number(impact.closing)],
        ['Normal', vector(impact.normal)],
        ['Witness points', `${vector(impact.pa)}; ${vector(impact.pb)}`],
      ]),
      ...strongest(impact.hits ?? []).slice(0, 40).map((hit, k) => element('div', {},
        element('h2', {}, `Contact ${k + 1}: ${this.name(hit.a)} – ${this.name(hit.b)}`),
        rows([
          ['Impulse', `${number(Math.hypot(...hit.impulse))} (${vector(hit.impulse)})`],
          ['Gap', number(hit.gap)],
          ['Speed of the gap', number(hit.speed)],
          ['Normal', vector(hit.normal)],
        ]))),
    ];
  }

  // The last mark but that of the end, and the numbers of all charts.
  #sample(t) {
    const {charts, samples, marks} = this.run;
    const row = samples.rows[samples.at(t)];
    const mark = marks.findLast((one) => one.t <= t && one.kind !== 'end');
    const names = charts.flatMap(({series}) => series);
    if (!row && !mark) return [element('h2', {}, 'Now'), element('p', {class: 'dim'}, 'Not known before the first tick.')];
    return [
      element('h2', {}, 'Now'),
      rows([
        mark && ['Status', mark.text],
        ...names.map((name, k) => row && [name[0].toUpperCase() + name.slice(1), digits(row[k], 4)]),
      ]),
    ];
  }

  #step(t) {
    const frames = this.run.frames;
    const k = Math.min(frames.at(t) + (frames.rows[frames.at(t)]?.end === t ? 0 : 1), frames.rows.length - 1);
    const frame = frames.rows[k];
    return [
      element('h2', {}, 'Step'),
      frame ? rows([
        ['Advance', `${k + 1} of ${frames.rows.length}: ${number(frame.begin)} to ${number(frame.end)}`],
        ['Committed steps', String(frame.steps)],
        ['Islands, substeps', `${frame.islands}, ${frame.substeps}`],
        ['Contacts', String(frame.contacts)],
        ['Solver residual', number(frame.residual)],
        frame.unconverged > 0 && ['Not converged', String(frame.unconverged)],
        frame.stalls > 0 && ['Stalls', String(frame.stalls)],
        ['Energy', `${number(frame.kinetic)} + ${number(frame.potential)} = ${number(frame.kinetic + frame.potential)}`],
        ['Momentum', vector(frame.momentum)],
        ['Angular momentum', vector(frame.angular_momentum)],
      ]) : element('p', {class: 'dim'}, 'Not recorded.'),
    ];
  }

  // By what the pairs that were near were proven apart over the step that ends at t or contains it.
  #proofs(t) {
    const gaps = this.run.gapsAt(t).filter(({proof}) => proof > 0);
    if (gaps.length === 0) return [];
    const counts = kProofWords.map((_, proof) => gaps.filter((gap) => gap.proof === proof).length);
    const size = ({lower, upper}) => (Number.isFinite(upper) ? upper : lower);
    // Of some a query says only that they did not meet.
    const measured = gaps.filter(({lower}) => lower > 0);
    const nearest = measured.sort((x, y) => size(x) - size(y)).slice(0, kMostProofs).sort((x, y) => x.lower - y.lower);
    return [
      element('h2', {}, `Proofs of ${gaps.length.toLocaleString('en')} near ${gaps.length === 1 ? 'pair' : 'pairs'}`),
      rows(kProofWords.map((words, proof) => counts[proof] > 0 && [counts[proof].toLocaleString('en'), words])),
      nearest.length > 0 && element('h2', {}, nearest.length < gaps.length ? `The ${nearest.length} nearest are apart by at least` : 'They are apart by at least'),
      rows(nearest.map(({a, b, lower, proof}) =>
        [digits(lower, 4), `${this.name(a)} – ${this.name(b)}: ${kProofWords[proof]}`])),
    ].filter(Boolean);
  }

  // How the run ended, once it is shown, and what was proven of its file.
  #ending(t) {
    const {ending, check, ownEnd} = this.run;
    return [
      ...(ending && t >= ownEnd ? [element('h2', {}, 'Why it ended'), element('p', {id: 'why-ended'}, ending)] : []),
      ...(check ? [element('h2', {}, 'Checked from the file alone'), element('pre', {class: 'words'}, check.words)] : []),
    ];
  }

  #frame(t, shown) {
    return [
      ...(this.run.charts.length > 0 ? this.#sample(t) : this.#step(t)),
      ...this.#ending(t),
      element('h2', {}, 'Nearest pair'),
      shown ? rows([
        ['Bodies', `${this.run.gapName(shown.a)} – ${this.run.gapName(shown.b)}`],
        ['Gap', number(shown.upper)],
        ['Proven', `at least ${number(shown.lower)}`],
        kProofWords[shown.proof] && ['Proven by', kProofWords[shown.proof]],
        Number.isFinite(shown.pivot?.[0]) && ['Pivot', vector(shown.pivot)],
      ]) : element('p', {class: 'dim'}, t < this.run.frames.rows[0]?.end
        ? 'Not known before the first step has ended.' : 'No gap was measured in this step.'),
      ...this.#proofs(t),
    ];
  }

  // `chosen` is {body} or {impact} or nothing; `shown` the pair whose witness is drawn.
  showData(t, chosen, shown) {
    if (this.host.data.hidden) return;
    const parts = [];
    if (chosen.impact) parts.push(...this.#impact(chosen.impact));
    if (chosen.body) parts.push(...this.#body(chosen.body, t));
    if (!chosen.impact && !chosen.body) {
      parts.push(element('p', {class: 'dim'}, 'Click a body or an event for its data.'));
    }
    this.host.data.replaceChildren(...parts, ...this.#frame(t, shown));
  }
}
