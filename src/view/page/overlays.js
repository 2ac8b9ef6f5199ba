// SPDX-License-Identifier: BSD-3-Clause
// What a debugger draws over the bodies: contacts with normals and impulses, the witness segment and
// pivot of the nearest pair, trails.
import * as THREE from 'three';

const kColors = {normal: 0x2f9e44, impulse: 0xd6336c, witness: 0x2563eb, pivot: 0xc2410c};
const kTrailSamples = 160;
const kMostTrails = 60;
const kMostArrows = 4000;
// Of the camera's distance: radius of the rods, of the pivot.
const kThickness = 1.1e-3;
const kPivotSize = 5e-3;

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
  commit() {
    this.lines.visible = this.points.length > 0;
    if (!this.lines.visible) return;
    this.geometry.setAttribute('position', new THREE.Float32BufferAttribute(this.points, 3));
  }
}

const kAlong = new THREE.Vector3(0, 1, 0);

// Rods with a tip, seen through everything: one instanced mesh for the rods and one for the tips.
class Arrows {
  constructor(scene, color) {
    this.scene = scene;
    this.material = new THREE.MeshBasicMaterial({color, depthTest: false, transparent: true});
    this.rod = new THREE.CylinderGeometry(1, 1, 1, 6).translate(0, 0.5, 0);
    this.tip = new THREE.ConeGeometry(1, 1, 8).translate(0, 0.5, 0);
    this.list = [];
    this.room = 0;
  }
  clear() {
    this.list.length = 0;
  }
  add(from, vector) {
    if (Math.hypot(...vector) > 0) this.list.push({from, vector});
  }
  #grow() {
    if (this.list.length <= this.room) return;
    this.room = 2 * this.list.length;
    for (const mesh of this.meshes ?? []) this.scene.remove(mesh), mesh.dispose();
    this.meshes = [this.rod, this.tip].map((geometry) => {
      const mesh = new THREE.InstancedMesh(geometry, this.material, this.room);
      mesh.frustumCulled = false;
      mesh.renderOrder = 2;
      this.scene.add(mesh);
      return mesh;
    });
  }
  // `thickness` is the radius of the rods, in the world.
  commit(thickness) {
    this.#grow();
    if (!this.meshes) return;
    const matrix = new THREE.Matrix4();
    const turn = new THREE.Quaternion();
    const [from, along, scale] = [0, 1, 2].map(() => new THREE.Vector3());
    this.list.forEach((arrow, k) => {
      along.fromArray(arrow.vector);
      const length = along.length();
      turn.setFromUnitVectors(kAlong, along.divideScalar(length));
      const tip = Math.min(8 * thickness, 0.5 * length);
      from.fromArray(arrow.from);
      this.meshes[0].setMatrixAt(k, matrix.compose(from, turn, scale.set(thickness, length - tip, thickness)));
      from.addScaledVector(along, length - tip);
      this.meshes[1].setMatrixAt(k, matrix.compose(from, turn, scale.set(0.36 * tip, tip, 0.36 * tip)));
    });
    for (const mesh of this.meshes) {
      mesh.count = this.list.length;
      mesh.visible = mesh.count > 0;
      mesh.instanceMatrix.needsUpdate = true;
    }
  }
}

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
    this.show = {contacts: true, witness: true, trails: false};
    const moving = this.run.bodies.filter((body) => body.kind === 'dynamic');
    this.bodyRadius = median(moving.map((body) => body.radius)) ?? Infinity;
    this.ordinary = new Map();
  }

  // An impulse as an arrow; one of ordinary size among its like is `length` long.
  #scaled(impulse, table, length) {
    let known = this.ordinary.get(table);
    if (known?.count !== table.rows.length) {
      known = {count: table.rows.length, size: ordinary(table.rows)};
      this.ordinary.set(table, known);
    }
    const size = Math.hypot(...impulse);
    const part = Math.min(1.6, Math.sqrt(size / known.size));
    return size > 0 ? impulse.map((x) => (x / size) * part * length) : [0, 0, 0];
  }

  // `impacts` are those to be seen at t.
  update(t, impacts, chosen) {
    const {distance} = this.stage;
    for (const layer of [this.normals, this.impulses, this.witness, this.trails]) layer.clear();
    if (this.show.contacts) this.#contacts(t, impacts, distance);
    this.#nearest(t, impacts);
    this.pivot.scale.setScalar(kPivotSize * distance);
    if (this.show.trails) this.#trails(t, chosen);
    this.normals.commit(0.6 * kThickness * distance);
    this.impulses.commit(kThickness * distance);
    for (const lines of [this.witness, this.trails]) lines.commit();
  }

  #contacts(t, impacts, distance) {
    const normalLength = Math.min(0.04 * distance, 0.5 * this.bodyRadius);
    const impulseLength = Math.min(0.1 * distance, 1.2 * this.bodyRadius);
    let left = kMostArrows;
    const draw = (p, normal, impulse, table) => {
      if (left-- <= 0) return;
      this.normals.add(p, normal.map((x) => normalLength * x));
      this.impulses.add(p, this.#scaled(impulse, table, impulseLength));
    };
    const {run} = this;
    for (const contact of run.contactsAt(t)) draw(contact.p, contact.normal, contact.impulse, run.contacts);
    for (const impact of impacts) {
      for (const hit of impact.hits ?? []) draw(hit.pb, hit.normal, hit.impulse, run.hits);
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
        const center = this.run.centerOf(body, at);
        if (last) this.trails.segment(last, center);
        last = center;
      }
    }
  }
}
