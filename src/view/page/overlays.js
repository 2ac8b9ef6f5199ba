// SPDX-License-Identifier: BSD-3-Clause
// What a debugger draws over the bodies: contacts with normals and impulses, the witness segment and
// pivot of the nearest pair, trails. Lines, so that thousands of them cost little.
import * as THREE from 'three';
import {turned} from './motion.js';

const kColors = {normal: 0x2f9e44, impulse: 0xd6336c, witness: 0x2563eb, pivot: 0xc2410c};
const kTrailSamples = 160;
const kMostTrails = 60;
const kMostArrows = 4000;

class Lines {
  constructor(scene, color, options = {}) {
    this.geometry = new THREE.BufferGeometry();
    this.lines = new THREE.LineSegments(
      this.geometry, new THREE.LineBasicMaterial({color, depthTest: false, transparent: true,
                                                  ...options}));
    this.lines.frustumCulled = false;
    this.lines.renderOrder = 2;
    scene.add(this.lines);
    this.points = [];
  }
  clear() {
    this.points.length = 0;
  }
  segment(a, b) {
    this.points.push(a[0], a[1], a[2], b[0], b[1], b[2]);
  }
  arrow(from, vector, size, axisHint) {
    const to = [0, 1, 2].map((k) => from[k] + vector[k]);
    this.segment(from, to);
    const along = new THREE.Vector3(...vector);
    const length = along.length();
    if (!(length > 0)) return;
    along.divideScalar(length);
    const side = along.clone().cross(axisHint);
    if (side.length() < 1e-3) side.set(along.y, along.z, along.x).cross(along);
    side.normalize();
    const head = Math.min(size, 0.35 * length);
    for (const sign of [-1, 1]) {
      const wing = new THREE.Vector3(...to).addScaledVector(along, -head)
        .addScaledVector(side, sign * 0.5 * head);
      this.segment(to, wing.toArray());
    }
  }
  commit() {
    this.lines.visible = this.points.length > 0;
    if (!this.lines.visible) return;
    this.geometry.setAttribute('position', new THREE.Float32BufferAttribute(this.points, 3));
  }
}

export class Overlays {
  constructor(stage) {
    this.stage = stage;
    this.run = stage.run;
    this.normals = new Lines(stage.scene, kColors.normal);
    this.impulses = new Lines(stage.scene, kColors.impulse);
    this.witness = new Lines(stage.scene, kColors.witness);
    this.trails = new Lines(stage.scene, 0x888888, {opacity: 0.8, depthTest: true});
    this.pivot = new THREE.Points(
      new THREE.BufferGeometry().setAttribute('position',
                                              new THREE.Float32BufferAttribute([0, 0, 0], 3)),
      new THREE.PointsMaterial({color: kColors.pivot, size: 9, sizeAttenuation: false,
                                depthTest: false, transparent: true}));
    this.pivot.frustumCulled = false;
    this.pivot.renderOrder = 3;
    stage.scene.add(this.pivot);
    this.show = {contacts: true, witness: true, trails: false};
    this.impulseScale = 0;
  }

  // An impulse as long as the larger ones seen so far is drawn this long.
  #scaled(impulse) {
    const size = Math.hypot(...impulse);
    this.impulseScale = Math.max(this.impulseScale, size);
    if (!(size > 0)) return [0, 0, 0];
    const length = 0.35 * this.stage.size * Math.sqrt(size / this.impulseScale);
    return impulse.map((x) => (x / size) * length);
  }

  // `impacts` are those to be seen at t.
  update(t, impacts, chosen) {
    const view = new THREE.Vector3();
    this.stage.camera.getWorldDirection(view);
    for (const lines of [this.normals, this.impulses, this.witness, this.trails]) lines.clear();
    if (this.show.contacts) this.#contacts(t, impacts, view);
    this.#nearest(t, impacts);
    if (this.show.trails) this.#trails(t, chosen);
    for (const lines of [this.normals, this.impulses, this.witness, this.trails]) lines.commit();
  }

  #contacts(t, impacts, view) {
    const head = 0.05 * this.stage.size;
    let left = kMostArrows;
    const draw = (p, normal, impulse) => {
      if (left-- <= 0) return;
      this.normals.arrow(p, normal.map((x) => 0.09 * this.stage.size * x), head, view);
      const arrow = this.#scaled(impulse);
      if (arrow.some((x) => x !== 0)) this.impulses.arrow(p, arrow, head, view);
    };
    for (const contact of this.run.contactsAt(t)) draw(contact.p, contact.normal, contact.impulse);
    for (const impact of impacts) {
      for (const hit of impact.hits ?? []) draw(hit.pb, hit.normal, hit.impulse);
    }
  }

  #nearest(t, impacts) {
    const impact = impacts.at(-1);
    const gap = this.run.nearestGap(t);
    this.shown = undefined;
    this.pivot.visible = false;
    if (!this.show.witness) return;
    if (impact) {
      this.shown = {pa: impact.pa, pb: impact.pb, a: impact.a, b: impact.b, lower: impact.lower,
                    upper: impact.upper, pivot: impact.pa.map((x, k) => (x + impact.pb[k]) / 2)};
    } else if (gap) {
      this.shown = gap;
    } else {
      return;
    }
    const {pa, pb, pivot} = this.shown;
    if (Number.isFinite(pa[0])) this.witness.segment(pa, pb);
    if (Number.isFinite(pivot[0])) {
      this.pivot.visible = true;
      this.pivot.position.set(...pivot);
    }
  }

  // The paths of centres of mass up to t: of the chosen body, or of all.
  #trails(t, chosen) {
    const span = this.run.end - this.run.begin;
    const begin = Math.max(this.run.begin, t - 0.35 * span);
    const bodies = chosen ? [chosen]
      : this.run.bodies.filter((body) => body.kind === 'dynamic').slice(0, kMostTrails);
    for (const body of bodies) {
      let last;
      for (let k = 0; k <= kTrailSamples; ++k) {
        const at = begin + ((t - begin) * k) / kTrailSamples;
        if (!this.run.isPresent(body, at)) continue;
        const {p, q} = this.run.state(body, at);
        const arm = turned(q, body.center);
        const center = [0, 1, 2].map((i) => p[i] + arm[i]);
        if (last) this.trails.segment(last, center);
        last = center;
      }
    }
  }
}
