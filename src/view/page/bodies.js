// SPDX-License-Identifier: BSD-3-Clause
// The tree of bodies: groups, a search, and for each body whether it is seen, its colour, and whether
// the camera follows it.
import {element} from './element.js';
import {VirtualList} from './virtual_list.js';

const kKindWords = {dynamic: 'moved by forces', kinematic: 'on a given motion', static: 'fixed'};
const kGroupings = {kind: 'by kind', island: 'by island, now', joints: 'by joints', shape: 'by shape', none: 'no groups'};

// A name of the group for each body: those that links join, directly or through others.
function joined(run) {
  const parent = run.bodies.map((_, k) => k);
  const find = (k) => (parent[k] === k ? k : (parent[k] = find(parent[k])));
  const byName = new Map(run.bodies.map((body) => [body.name, body]));
  for (const {a, b} of run.links.joints ?? []) {
    const [one, other] = [byName.get(a), byName.get(b)];
    if (one?.kind === 'dynamic' && other?.kind === 'dynamic') parent[find(one.number)] = find(other.number);
  }
  const inJoint = new Set((run.links.joints ?? []).flatMap(({a, b}) => [a, b]));
  return run.bodies.map((body, k) => (inJoint.has(body.name) ? `joined with ${run.bodies[find(k)].name}` : 'without joints'));
}

export class BodyTree {
  // `act` has chooseBody(body), setHidden(numbers, isHidden), setColor(number, text), follow(body).
  constructor(host, run, act) {
    this.host = host;
    this.run = run;
    this.act = act;
    this.text = '';
    this.grouping = 'kind';
    this.closed = new Set();
    this.hidden = new Set();
  }

  #build() {
    const search = element('input', {type: 'search', placeholder: 'Search bodies', 'aria-label': 'Search bodies', oninput: () => {
      this.text = search.value.toLowerCase();
      this.#arrange();
    }});
    const grouping = element('select', {'aria-label': 'Groups', onchange: () => {
      this.grouping = grouping.value;
      this.#arrange();
    }}, ...Object.entries(kGroupings).map(([value, words]) => element('option', {value}, words)));
    const all = element('button', {onclick: () => this.#setHidden(this.run.bodies, false)}, 'Show all');
    this.count = element('p', {class: 'dim'});
    this.list = new VirtualList('Bodies', (item) => (item.group === undefined ? this.#row(item.body) : this.#header(item)),
                                {role: 'group'});
    this.host.replaceChildren(element('div', {class: 'filters'}, search, grouping, all), this.count, this.list.node);
    this.#arrange();
  }

  #groupOf() {
    const {run} = this;
    if (this.grouping === 'kind') return run.bodies.map(({kind}) => kKindWords[kind]);
    if (this.grouping === 'joints') return joined(run);
    if (this.grouping === 'shape') return run.bodies.map(({shape, shape_name: name}) => `${name || 'shape'} (${shape + 1})`);
    if (this.grouping !== 'island') return run.bodies.map(() => '');
    const islands = run.islandsAt(this.t);
    return run.bodies.map(({kind}, k) => (kind === 'dynamic' ? `island of ${run.bodies[islands[k]].name}` : kKindWords[kind]));
  }

  #arrange() {
    const groups = new Map();
    const names = this.#groupOf();
    let count = 0;
    for (const body of this.run.bodies) {
      if (!body.name.toLowerCase().includes(this.text)) continue;
      count += 1;
      const name = names[body.number];
      if (groups.has(name)) groups.get(name).push(body);
      else groups.set(name, [body]);
    }
    this.bodyCount = this.run.bodies.length;
    this.count.textContent = `${count} of ${this.run.bodies.length} bodies, ${this.run.surfaces.length} shapes`;
    this.list.set([...groups].flatMap(([group, bodies]) => {
      const own = this.closed.has(group) ? [] : bodies.map((body) => ({body}));
      return group === '' ? own : [{group, bodies}, ...own];
    }));
  }

  #setHidden(bodies, isHidden) {
    for (const {number} of bodies) {
      if (isHidden) this.hidden.add(number);
      else this.hidden.delete(number);
    }
    this.act.setHidden(this.hidden);
    this.list.draw();
  }

  #eye(bodies, label) {
    const box = element('input', {type: 'checkbox', 'aria-label': `Show ${label}`, title: 'Shown or hidden',
                                  onclick: (event) => event.stopPropagation(),
                                  onchange: () => this.#setHidden(bodies, !box.checked)});
    box.checked = bodies.some(({number}) => !this.hidden.has(number));
    return box;
  }

  #header({group, bodies}) {
    const isOpen = !this.closed.has(group);
    return element('div', {class: 'row group'}, this.#eye(bodies, `all of ${group}`),
                   element('button', {class: 'plain', 'aria-expanded': String(isOpen), onclick: () => {
                     if (isOpen) this.closed.add(group);
                     else this.closed.delete(group);
                     this.#arrange();
                   }}, `${isOpen ? '▾' : '▸'} ${group} (${bodies.length})`));
  }

  #row(body) {
    const isChosen = this.chosen === body;
    const color = element('input', {type: 'color', value: `#${this.colors[body.number].getHexString()}`, title: 'Colour',
                                    'aria-label': `Colour of ${body.name}`, oninput: () => this.act.setColor(body.number, color.value)});
    const row = element('div', {class: 'row body'}, this.#eye([body], body.name), color,
                        element('button', {class: 'plain what', 'aria-pressed': String(isChosen), title: body.name,
                                           onclick: () => this.act.chooseBody(body)}, body.name),
                        element('button', {class: 'plain', title: 'The camera goes with it', 'aria-label': `Follow ${body.name}`,
                                           onclick: () => this.act.follow(body)}, '◎'));
    row.classList.toggle('now', isChosen);
    return row;
  }

  show(t, colors, chosen) {
    const isOther = this.chosen !== chosen.body;
    [this.t, this.colors, this.chosen] = [t, colors, chosen.body];
    if (this.host.hidden) {
      this.drawn = undefined;
      return;
    }
    if (!this.list) this.#build();
    const key = `${this.grouping === 'island' ? t : ''} ${colors.slice(0, 400).map((color) => color.getHex()).join()}`;
    if (this.drawn === key && !isOther && this.bodyCount === this.run.bodies.length) return;
    // A colour that is being chosen keeps its row.
    if (document.activeElement?.type === 'color' && this.host.contains(document.activeElement)) return;
    this.drawn = key;
    const hasGrown = this.bodyCount !== this.run.bodies.length;
    if (this.grouping === 'island' || hasGrown) this.#arrange();
    else this.list.draw();
  }
}
