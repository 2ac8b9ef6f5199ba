// SPDX-License-Identifier: BSD-3-Clause
// Lines, rods, balls and arrows that are drawn over the bodies.
import * as THREE from 'three';

// What is drawn stands relative to the place where the camera looks (Stage.origin), so that single
// precision is enough also for a close-up far from the world's origin.
export class Lines {
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
  commit(origin) {
    this.lines.visible = this.points.length > 0;
    if (!this.lines.visible) return;
    this.lines.position.copy(origin);
    const parts = origin.toArray();
    this.geometry.setAttribute('position', new THREE.Float32BufferAttribute(this.points.map((x, k) => x - parts[k % 3]), 3));
  }
}

const kAlong = new THREE.Vector3(0, 1, 0);
const matrix = new THREE.Matrix4();
const turn = new THREE.Quaternion();
const place = new THREE.Vector3();
const along = new THREE.Vector3();
const scale = new THREE.Vector3();

// Copies of one geometry, as many as are needed.
class Copies {
  constructor(scene, geometry, material) {
    this.scene = scene;
    this.geometry = geometry;
    this.material = material;
    this.room = 0;
  }
  // `put(k, matrix)` sets the matrix of each.
  commit(count, origin, put) {
    if (count > this.room) this.#grow(2 * count);
    if (!this.mesh) return;
    this.mesh.position.copy(origin);
    for (let k = 0; k < count; ++k) {
      put(k);
      matrix.setPosition(place.setFromMatrixPosition(matrix).sub(origin));
      this.mesh.setMatrixAt(k, matrix);
    }
    this.mesh.count = count;
    this.mesh.visible = count > 0;
    this.mesh.instanceMatrix.needsUpdate = true;
  }
  #grow(room) {
    if (this.mesh) this.scene.remove(this.mesh), this.mesh.dispose();
    this.room = room;
    this.mesh = new THREE.InstancedMesh(this.geometry, this.material, room);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 2;
    this.scene.add(this.mesh);
  }
}

// Seen through everything.
function plain(color) {
  return new THREE.MeshBasicMaterial({color, depthTest: false, transparent: true});
}

const kRod = new THREE.CylinderGeometry(1, 1, 1, 6).translate(0, 0.5, 0);
const kTip = new THREE.ConeGeometry(1, 1, 8).translate(0, 0.5, 0);
const kBall = new THREE.SphereGeometry(1, 12, 8);

export class Balls {
  constructor(scene, color) {
    this.copies = new Copies(scene, kBall, plain(color));
    this.list = [];
  }
  clear() {
    this.list.length = 0;
  }
  add(point) {
    this.list.push(point);
  }
  commit(radius, origin) {
    this.copies.commit(this.list.length, origin, (k) =>
      matrix.compose(place.fromArray(this.list[k]), turn.identity(), scale.setScalar(radius)));
  }
}

// Rods with a tip, or without.
export class Arrows {
  constructor(scene, color, {hasTips = true} = {}) {
    const material = plain(color);
    this.rods = new Copies(scene, kRod, material);
    this.tips = hasTips ? new Copies(scene, kTip, material) : undefined;
    this.list = [];
  }
  clear() {
    this.list.length = 0;
  }
  add(from, vector) {
    const length = Math.hypot(...vector);
    if (length > 0) this.list.push({from, direction: vector.map((x) => x / length), length});
  }
  // `thickness` is the radius of the rods, in the world.
  commit(thickness, origin) {
    const tipOf = (length) => (this.tips ? Math.min(8 * thickness, 0.5 * length) : 0);
    const point = ({from, direction}) => {
      place.fromArray(from);
      turn.setFromUnitVectors(kAlong, along.fromArray(direction));
    };
    this.rods.commit(this.list.length, origin, (k) => {
      const {length} = this.list[k];
      point(this.list[k]);
      matrix.compose(place, turn, scale.set(thickness, length - tipOf(length), thickness));
    });
    this.tips?.commit(this.list.length, origin, (k) => {
      const {length} = this.list[k];
      const tip = tipOf(length);
      point(this.list[k]);
      place.addScaledVector(along, length - tip);
      matrix.compose(place, turn, scale.set(0.36 * tip, tip, 0.36 * tip));
    });
  }
}
