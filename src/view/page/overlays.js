// SPDX-License-Identifier: BSD-3-Clause
// What a debugger draws over the bodies: contacts with normals and impulses, the witness segment and
// pivot of the nearest pair, joints, trails.
import * as THREE from 'three';
import {Links} from './links.js';
import {Arrows, Lines} from './marks.js';
import {Rounds} from './rounds.js';

const kColors = {normal: 0x2f9e44, impulse: 0xd6336c, witness: 0x2563eb, pivot: 0xc2410c, plane: 0x7c3aed};
const kPlaneSize = {ofBody: 1.3, ofView: 0.35};  // half a side: of the smaller body's radius, of the camera's distance
const kTrailSamples = 160;
const kMostTrails = 60;
const kMostContacts = {still: 1500, moving: 300};  // the strongest ones are drawn
// Radius of the rods, of the pivot, as fractions of the camera's distance.
const kThickness = 1.1e-3;
const kPivotSize = 5e-3;

function median(values) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.floor(sorted.length / 2)];
}

// What an impulse of ordinary size is, so that the few largest do not dwarf the rest.
function ordinary(rows) {
  const sizes = rows.map(({impulse}) => Math.hypot(...impulse)).filter((size) => size > 0);
  sizes.sort((a, b) => a - b);
  return sizes[Math.floor(0.9 * sizes.length)] ?? 1;
}

// The contacts with the largest impulses, at most so many.
function strongest(contacts, most) {
  if (contacts.length <= most) return contacts;
  const size = ({impulse: [x, y, z]}) => x * x + y * y + z * z;
  return contacts.map((contact) => [size(contact), contact]).sort(([a], [b]) => b - a).slice(0, most).map(([, contact]) => contact);
}

// The nearest points of two balls, from their centres: the recording has none where a bound was enough.
function betweenBalls(run, {a, b}, t) {
  const [from, to] = [a, b].map((number) => {
    const {name, values} = run.shapes[run.bodies[number].shape].form ?? {};
    return {p: run.state(run.bodies[number], t).p, radius: name === 'sphere' ? values[0] : NaN};
  });
  const way = to.p.map((x, k) => x - from.p[k]);
  const length = Math.hypot(...way);
  return {pa: from.p.map((x, k) => x + (from.radius / length) * way[k]),
          pb: to.p.map((x, k) => x - (to.radius / length) * way[k])};
}

export class Overlays {
  constructor(stage) {
    this.stage = stage;
    this.run = stage.run;
    this.impulses = new Arrows(stage.scene, kColors.impulse);
    this.normals = new Arrows(stage.scene, kColors.normal);
    this.witness = new Lines(stage.scene, kColors.witness);
    this.trails = new Lines(stage.scene, 0x888888, {opacity: 0.8, depthTest: true});
    this.pivot = new THREE.Mesh(
      new THREE.SphereGeometry(1, 16, 10),
      new THREE.MeshBasicMaterial({color: kColors.pivot, depthTest: false, transparent: true}));
    this.pivot.frustumCulled = false;
    this.pivot.renderOrder = 3;
    stage.scene.add(this.pivot);
    this.mostContacts = kMostContacts;
    this.#addPlane();
    this.show = {contacts: true, witness: true, joints: true, trails: false, plane: false};
    const moving = this.run.movers;
    this.links = new Links(stage);
    this.rounds = new Rounds(stage);
    this.bodyRadius = median(moving.map((body) => body.radius)) ?? Infinity;
    this.ordinary = new Map();
  }

  // Two translucent sides and a border.
  #addPlane() {
    const sheet = new THREE.PlaneGeometry(2, 2);
    this.plane = new THREE.Mesh(sheet, new THREE.MeshBasicMaterial({
      color: kColors.plane, transparent: true, opacity: 0.28, side: THREE.DoubleSide, depthWrite: false}));
    this.plane.add(new THREE.LineSegments(new THREE.EdgesGeometry(sheet), new THREE.LineBasicMaterial({color: kColors.plane})));
    this.plane.visible = false;
    this.plane.raycast = () => {};
    this.stage.scene.add(this.plane);
  }

  // Across the shortest way of the pair that is shown, in its middle.
  #layPlane(distance) {
    const {pa, pb, a, b} = this.shown ?? {};
    const way = new THREE.Vector3(...(pb ?? [NaN])).sub(new THREE.Vector3(...(pa ?? [NaN])));
    this.plane.visible = this.show.plane && way.length() > 0;
    if (!this.plane.visible) return;
    this.plane.position.set(...pa).addScaledVector(way, 0.5);
    this.plane.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), way.normalize());
    const radius = Math.min(...[a, b].map((number) => this.run.bodies[number].radius));
    this.plane.scale.setScalar(Math.min(kPlaneSize.ofBody * radius, kPlaneSize.ofView * distance));
  }

  // An impulse as an arrow; one of ordinary size among its like is `length` long.
  #scaled(impulse, table, length) {
    let known = this.ordinary.get(table);
    if (known?.count !== table.rows.length || this.run.blocks !== this.blocks) {
      this.blocks = this.run.blocks;
      const isOfChunks = table === this.run.contacts && this.run.isLarge;
      known = {count: table.rows.length, size: isOfChunks ? this.run.ordinaryImpulse ?? 1 : ordinary(table.rows)};
      this.ordinary.set(table, known);
    }
    const size = Math.hypot(...impulse);
    const part = Math.min(1.6, Math.sqrt(size / known.size));
    return size > 0 ? impulse.map((x) => (x / size) * part * length) : [0, 0, 0];
  }

  // `impacts` are those to be seen at t.
  update(t, impacts, chosen, isStill = true) {
    const {distance, origin} = this.stage;
    for (const layer of [this.normals, this.impulses, this.witness, this.trails]) layer.clear();
    [this.drawnContacts, this.contactCount] = [[], 0];
    if (this.show.contacts) this.#contacts(t, impacts, distance, isStill ? this.mostContacts.still : this.mostContacts.moving);
    this.#nearest(t, impacts);
    this.rounds.update(this.shown, t);
    this.#layPlane(distance);
    this.pivot.scale.setScalar(kPivotSize * distance);
    if (this.show.trails) this.#trails(t, chosen);
    this.links.update(t, this.show.joints, kThickness * distance, origin);
    this.normals.commit(0.6 * kThickness * distance, origin);
    this.impulses.commit(kThickness * distance, origin);
    for (const lines of [this.witness, this.trails]) lines.commit(origin);
  }

  // Colour, words and sign of each kind of mark that is seen now.
  legend() {
    const css = (color) => `#${color.toString(16).padStart(6, '0')}`;
    const {links, contactCount: all, drawnContacts: {length}} = this;
    const words = length === 1 ? 'the strongest' : `the ${length.toLocaleString('en')} strongest`;
    const part = length < all ? `, ${words} of ${all.toLocaleString('en')}` : '';
    return [
      this.normals.list.length > 0 && [css(kColors.normal), `normal of a contact${part}`, 'arrow'],
      this.impulses.list.length > 0 && [css(kColors.impulse), 'impulse', 'arrow'],
      this.witness.points.length > 0 && [css(kColors.witness), 'shortest way between the nearest pair', 'line'],
      this.pivot.visible && [css(kColors.pivot), 'pivot, the middle of that way', 'dot'],
      this.plane.visible && [css(kColors.plane), 'plane between the nearest pair'],
      ...links.legend(css),
      this.trails.points.length > 0 && ['#888888', 'path', 'line'],
      this.stage.alone && [undefined, 'close up: only this pair is drawn'],
    ].filter(Boolean);
  }

  #contacts(t, impacts, distance, most) {
    const normalLength = Math.min(0.04 * distance, 0.5 * this.bodyRadius);
    const impulseLength = Math.min(0.1 * distance, 1.2 * this.bodyRadius);
    const draw = (p, normal, impulse, table) => {
      this.normals.add(p, normal.map((x) => normalLength * x));
      this.impulses.add(p, this.#scaled(impulse, table, impulseLength));
    };
    const {run} = this;
    const all = run.contactsAt(t);
    this.drawnContacts = strongest(all, most);
    this.contactCount = all.length;
    for (const contact of this.drawnContacts) draw(contact.p, contact.normal, contact.impulse, run.contacts);
    for (const impact of impacts) {
      for (const hit of impact.hits ?? []) draw(hit.pb, hit.normal, hit.impulse, run.hits);
    }
  }

  #nearest(t, impacts) {
    const impact = impacts.at(-1);
    const gap = this.run.nearestGap(t);
    this.shown = undefined;
    this.pivot.visible = false;
    if (!this.show.witness && !this.show.plane) return;
    if (impact) {
      this.shown = {pa: impact.pa, pb: impact.pb, a: impact.a, b: impact.b, lower: impact.lower,
                    upper: impact.upper, pivot: impact.pa.map((x, k) => (x + impact.pb[k]) / 2)};
    } else if (gap) {
      this.shown = Number.isFinite(gap.pa[0]) ? gap : {...gap, ...betweenBalls(this.run, gap, t)};
    } else {
      return;
    }
    // The pivot of a pair with several contacts may be that of another one.
    const {pa, pb} = this.shown;
    if (!Number.isFinite(pa[0])) return;
    this.shown = {...this.shown, pivot: pa.map((x, k) => (x + pb[k]) / 2)};
    if (!this.show.witness) return;
    this.witness.segment(pa, pb);
    this.pivot.visible = true;
    this.pivot.position.set(...this.shown.pivot);
  }

  // The paths of centres of mass up to t: of the chosen body, or of all.
  #trails(t, chosen) {
    const span = this.run.end - this.run.begin;
    const begin = Math.max(this.run.begin, t - 0.35 * span);
    const bodies = chosen ? [chosen]
      : this.run.movers.slice(0, kMostTrails);
    for (const body of bodies) {
      let last;
      for (let k = 0; k <= kTrailSamples; ++k) {
        const at = begin + ((t - begin) * k) / kTrailSamples;
        if (!this.run.isPresent(body, at)) continue;
        const center = this.run.centerOf(body, at);
        if (last) this.trails.segment(last, center);
        last = center;
      }
    }
  }
}
