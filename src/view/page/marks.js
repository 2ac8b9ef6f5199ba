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

const matrix = new THREE.Matrix4();
const turn = new THREE.Quaternion();
const place = new THREE.Vector3();
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

// Flat strips that face the camera look like rods and cones here, as no light falls on them, and are
// three triangles. Corners are (place, side): place 0 and 1 are the ends of the rod, 2 and 3 the base and
// the point of the tip.
const kRodCorners = [[0, -1], [1, -1], [1, 1], [0, -1], [1, 1], [0, 1]];
const kTipCorners = [[2, -1], [3, 0], [2, 1]];
const kArrowShader = `
  vec3 along = (modelViewMatrix * vec4(way, 0.0)).xyz;
  float size = length(along);
  float tip = hasTips ? min(8.0 * thickness, 0.5 * size) : 0.0;
  float place = position.x < 0.5 ? 0.0 : position.x < 2.5 ? size - tip : size;
  vec4 mvPosition = modelViewMatrix * vec4(tail, 1.0);
  mvPosition.xyz += along * (place / size);
  vec3 across = cross(along, mvPosition.xyz);
  float slant = length(across);
  across = slant > 1e-6 * size * length(mvPosition.xyz) ? across / slant : vec3(1.0, 0.0, 0.0);
  // Seen from its end a rod is a square.
  vec3 back = normalize(cross(across, mvPosition.xyz));
  mvPosition.xyz += across * position.y * (position.x > 1.5 ? 0.36 * tip : thickness);
  if (position.x < 0.5) mvPosition.xyz += back * thickness;
  gl_Position = projectionMatrix * mvPosition;`;

function arrowMaterial(color, uniforms) {
  const material = plain(color);
  material.side = THREE.DoubleSide;
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, uniforms);
    shader.vertexShader = 'attribute vec3 tail;\nattribute vec3 way;\nuniform float thickness;\nuniform bool hasTips;\n' +
      shader.vertexShader.replace('#include <project_vertex>', kArrowShader);
  };
  return material;
}

// Rods with a tip, or without.
export class Arrows {
  constructor(scene, color, {hasTips = true} = {}) {
    this.scene = scene;
    this.uniforms = {thickness: {value: 1}, hasTips: {value: hasTips}};
    this.material = arrowMaterial(color, this.uniforms);
    this.corners = new Float32Array((hasTips ? [...kRodCorners, ...kTipCorners] : kRodCorners).flatMap((corner) => [...corner, 0]));
    this.list = [];
    this.room = 0;
  }
  clear() {
    this.list.length = 0;
  }
  add(from, vector) {
    const length = Math.hypot(...vector);
    if (length > 0) this.list.push({from, vector});
  }
  #grow(room) {
    if (this.mesh) this.scene.remove(this.mesh), this.mesh.geometry.dispose();
    this.room = room;
    const geometry = new THREE.InstancedBufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(this.corners, 3));
    for (const name of ['tail', 'way']) geometry.setAttribute(name, new THREE.InstancedBufferAttribute(new Float32Array(3 * room), 3));
    this.mesh = new THREE.Mesh(geometry, this.material);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 2;
    this.mesh.raycast = () => {};
    this.scene.add(this.mesh);
  }
  // `thickness` is the radius of the rods, in the world.
  commit(thickness, origin) {
    const {length} = this.list;
    if (length > this.room) this.#grow(2 * length);
    if (!this.mesh) return;
    this.mesh.visible = length > 0;
    this.mesh.position.copy(origin);
    const {tail, way} = this.mesh.geometry.attributes;
    this.list.forEach(({from, vector}, k) => {
      tail.setXYZ(k, from[0] - origin.x, from[1] - origin.y, from[2] - origin.z);
      way.setXYZ(k, ...vector);
    });
    this.mesh.geometry.instanceCount = length;
    tail.needsUpdate = way.needsUpdate = true;
    this.uniforms.thickness.value = thickness;
  }
}
