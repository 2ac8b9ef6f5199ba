// SPDX-License-Identifier: BSD-3-Clause
// Joints, springs and locked axes of the scene file, as they move with their bodies.
import {dot, turned} from './motion.js';
import {Arrows, Balls} from './marks.js';

const kColors = {joint: 0x8b5cf6, spring: 0x0891b2, locked: 0x7b8794};
const kCoils = 9;
const kAxes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

const sum = (a, b, factor = 1) => a.map((x, k) => x + factor * b[k]);

// A point of the world, or a direction, seen from a body; `at` is the body's state.
function pointIn(at, p) {
  return directionIn(at, sum(p, at.p, -1));
}

function directionIn({q}, v) {
  return turned([-q[0], -q[1], -q[2], q[3]], v);
}

const pointOf = (at, p) => sum(at.p, turned(at.q, p));

// Some direction across a unit vector.
function across(v) {
  const axis = kAxes.reduce((best, one) => (Math.abs(dot(one, v)) < Math.abs(dot(best, v)) ? one : best));
  const rest = sum(axis, v, -dot(axis, v));
  const length = Math.hypot(...rest);
  return rest.map((x) => x / length);
}

// Axes that leave one way to move, such as an axle: the only free one of three.
function onlyFree(locked) {
  const free = [0, 1, 2].filter((k) => !locked?.[k]);
  return free.length === 1 ? kAxes[free[0]] : undefined;
}

// Where joints are at the beginning, in the world.
export function jointPoints(run) {
  return (run.links.joints ?? []).filter(({point}) => point).map(({point}) => point);
}

export class Links {
  constructor(stage) {
    this.run = stage.run;
    this.layers = Object.fromEntries(Object.entries(kColors).map(([name, color]) => [name, {
      rods: new Arrows(stage.scene, color, {hasTips: false}),
      struts: new Arrows(stage.scene, color, {hasTips: false}),  // thin
      balls: new Balls(stage.scene, color)}]));
  }

  // The joints and springs with their points seen from their bodies, once both have a place.
  #known() {
    if (this.list) return this.list;
    const {run} = this;
    const byName = new Map(run.bodies.map((body) => [body.name, body]));
    const start = (body) => ({p: [...run.state(body, run.begin).p], q: [...run.state(body, run.begin).q]});
    this.list = [];
    for (const joint of run.links.joints ?? []) {
      const [a, b] = [byName.get(joint.a), byName.get(joint.b)];
      if (!a || !b || !run.isPresent(a, run.begin) || !run.isPresent(b, run.begin)) continue;
      const size = Math.min(...[a, b].filter(({kind}) => kind === 'dynamic').map(({radius}) => radius));
      if (joint.kind === 'distance') {
        this.list.push({kind: 'distance', a, b, pa: joint.point_a ?? [0, 0, 0], pb: joint.point_b ?? [0, 0, 0]});
        continue;
      }
      const axis = joint.axis ?? [0, 0, 1];
      const length = Math.hypot(...axis);
      this.list.push({kind: joint.kind, a, b, size, pa: pointIn(start(a), joint.point ?? [0, 0, 0]),
                      pb: pointIn(start(b), joint.point ?? [0, 0, 0]),
                      axis: directionIn(start(b), axis.map((x) => x / length))});
    }
    for (const spring of run.links.springs ?? []) {
      const [a, b] = [byName.get(spring.a ?? spring.body), byName.get(spring.b)];
      if (!a) continue;
      this.list.push({kind: 'spring', a, b, pa: spring.point_a ?? spring.point ?? [0, 0, 0],
                      pb: spring.point_b ?? spring.anchor ?? [0, 0, 0]});
    }
    for (const [name, locked] of Object.entries(run.links.locked ?? {})) {
      const a = byName.get(name);
      if (a) this.list.push({kind: 'locked', a, locked, size: a.radius});
    }
    return this.list;
  }

  legend(css) {
    const words = {joint: 'joint', spring: 'spring', locked: 'axle or rail'};
    return Object.entries(this.layers).filter(([, {rods, balls}]) => rods.list.length + balls.list.length > 0)
      .map(([name]) => [css(kColors[name]), words[name], 'line']);
  }

  // The point of each joint at time t, of one body and of the other.
  jointEnds(t) {
    return this.#known().filter(({kind, b}) => b && kind !== 'spring' && kind !== 'distance' && kind !== 'slider')
      .map(({a, b, pa, pb}) => [pointOf(this.run.state(a, t), pa), pointOf(this.run.state(b, t), pb)]);
  }

  update(t, isShown, thickness, origin) {
    for (const marks of Object.values(this.layers).flatMap((layer) => Object.values(layer))) marks.clear();
    if (isShown) for (const link of this.#known()) this.#draw(link, t);
    for (const {rods, struts, balls} of Object.values(this.layers)) {
      rods.commit(thickness, origin);
      struts.commit(0.5 * thickness, origin);
      balls.commit(2.6 * thickness, origin);
    }
  }

  #draw(link, t) {
    const {run} = this;
    const {a, b} = link;
    if (!run.isPresent(a, t) || (b && !run.isPresent(b, t))) return;
    const layer = this.layers[link.kind === 'spring' || link.kind === 'locked' ? link.kind : 'joint'];
    if (link.kind === 'locked') return this.#locked(link, t, layer);
    const pa = pointOf(run.state(a, t), link.pa);
    const pb = b ? pointOf(run.state(b, t), link.pb) : link.pb;
    layer.balls.add(pb);
    if (link.kind === 'distance' || link.kind === 'spring') layer.balls.add(pa);
    if (link.kind === 'distance') layer.rods.add(pa, sum(pb, pa, -1));
    if (link.kind === 'spring') this.#coil(pa, pb, layer.rods);
    if (link.kind === 'hinge' || link.kind === 'slider') {
      const half = (link.kind === 'hinge' ? 0.8 : 1.6) * link.size;
      this.#bar(pb, turned(run.state(b, t).q, link.axis), half, layer.rods);
    }
    if (link.kind !== 'distance' && link.kind !== 'spring') {
      for (const body of [a, b]) {
        if (body.kind === 'dynamic') layer.struts.add(pb, sum(run.centerOf(body, t), pb, -1));
      }
    }
    // A ball says where it is; a fixed joint is a cross.
    if (link.kind === 'fixed') {
      for (const axis of kAxes) this.#bar(pb, turned(run.state(b, t).q, axis), 0.25 * link.size, layer.rods);
    }
  }

  #bar(middle, axis, half, rods) {
    rods.add(sum(middle, axis, -half), axis.map((x) => 2 * half * x));
  }

  // A zigzag, whose ends are straight.
  #coil(from, to, rods) {
    const whole = sum(to, from, -1);
    const length = Math.hypot(...whole);
    if (!(length > 0)) return;
    const side = across(whole.map((x) => x / length));
    let last = from;
    for (let k = 0; k <= kCoils; ++k) {
      const swing = k === kCoils ? 0 : (k % 2 === 0 ? 1 : -1) * 0.07 * length;
      const next = k === kCoils ? to : sum(sum(from, whole, (k + 1) / (kCoils + 1)), side, swing);
      rods.add(last, sum(next, last, -1));
      last = next;
    }
  }

  // An axle or a rail, if that is what is left.
  #locked({a, locked, size}, t, {rods, balls}) {
    const center = this.run.centerOf(a, t);
    const axle = onlyFree(locked.rotation);
    const rail = onlyFree(locked.translation);
    if (axle) this.#bar(center, axle, 0.6 * size, rods);
    if (rail) this.#bar(center, rail, 2 * size, rods);
    balls.add(center);
  }
}

// What ties a body, in words.
export function tiesOf(run, body) {
  const words = [];
  for (const {kind, a, b} of run.links.joints ?? []) {
    if (a === body.name || b === body.name) words.push(`${kind} with ${a === body.name ? b : a}`);
  }
  for (const spring of run.links.springs ?? []) {
    const ends = [spring.a ?? spring.body, spring.b];
    if (ends.includes(body.name)) words.push(`spring to ${ends.find((name) => name !== body.name) ?? 'a fixed point'}`);
  }
  const locked = run.links.locked?.[body.name];
  for (const way of ['translation', 'rotation']) {
    const axes = ['x', 'y', 'z'].filter((_, k) => locked?.[way]?.[k]);
    if (axes.length > 0) words.push(`no ${way} ${way === 'translation' ? 'along' : 'about'} ${axes.join(', ')}`);
  }
  return words;
}
