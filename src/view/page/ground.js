// SPDX-License-Identifier: BSD-3-Clause
// Where am I: a grid on the ground, a bar with a length, and the axes of the world.
import * as THREE from 'three';
import {element} from './element.js';

const kCells = 8;          // across what the camera frames
const kMostCells = 40;     // to either side
const kLeastBar = 70;      // pixels
const kLeastCell = 4;      // pixels
const kAxes = [['x', '#e03131'], ['y', '#2b8a3e'], ['z', '#1971c2']];
const kAxisLength = 22;    // pixels
const kBias = 3e-5;        // of the depth: so that lines on a floor are seen

// 1, 2 or 5 times a power of ten, at least x.
export function roundLength(x) {
  const power = 10 ** Math.floor(Math.log10(x));
  return [1, 2, 5, 10].map((factor) => factor * power).find((length) => length >= 0.999 * x);
}

// Nothing but digits, and an exponent where there would be many zeros.
function lengthText(x) {
  return x >= 1e-3 && x < 1e5 ? String(Number(x.toPrecision(3))) : x.toExponential(0).replace('+', '');
}

// Corners of a body's box at time t, in the world.
function corners(run, shapes, body, t) {
  const {min, max} = shapes[body.shape].geometry.boundingBox;
  const {p, q} = run.state(body, t);
  const turn = new THREE.Quaternion(...q);
  const at = new THREE.Vector3(...p);
  return Array.from({length: 8}, (_, k) => new THREE.Vector3(
    k & 1 ? max.x : min.x, k & 2 ? max.y : min.y, k & 4 ? max.z : min.z).applyQuaternion(turn).add(at));
}

// Large fixed bodies below all that moves are floors; they get a tone of their own.
export function findFloors(run, shapes, up) {
  const height = (body) => new THREE.Vector3(...run.centerOf(body, run.begin)).dot(up);
  const lowest = Math.min(...run.movers.filter((body) => run.isPresent(body, run.begin)).map(height));
  const isNew = (body) => body.isGround && run.isPresent(body, run.begin);
  for (const body of run.bodies.filter(isNew)) {
    const places = corners(run, shapes, body, run.begin);
    body.top = Math.max(...places.map((corner) => corner.dot(up)));
    body.isFloor = body.top <= lowest;
    // The grid lies on it only if its top is level.
    const reach = 1e-4 * body.radius;
    body.isLevel = body.isFloor && places.filter((corner) => corner.dot(up) > body.top - reach).length >= 4;
    body.corners = places;
  }
}

export class Ground {
  constructor(stage, host) {
    this.stage = stage;
    this.isShown = true;
    const material = new THREE.LineBasicMaterial({transparent: true, opacity: 0.3, depthWrite: false});
    material.onBeforeCompile = (shader) => {
      shader.vertexShader = shader.vertexShader.replace(
        '#include <project_vertex>', `#include <project_vertex>\ngl_Position.z -= ${kBias} * gl_Position.w;`);
    };
    this.grid = new THREE.LineSegments(new THREE.BufferGeometry(), material);
    this.grid.frustumCulled = false;
    stage.scene.add(this.grid);
    this.#addMarks(host);
  }

  #addMarks(host) {
    const svg = (tag, attributes) => {
      const node = document.createElementNS('http://www.w3.org/2000/svg', tag);
      for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
      return node;
    };
    this.triad = svg('svg', {viewBox: '-34 -34 68 68', width: 68, height: 68, role: 'img', 'aria-label': 'Axes of the world'});
    this.arms = kAxes.map(([name, color]) => {
      const group = svg('g', {stroke: color, fill: color});
      const line = svg('line', {x1: 0, y1: 0, 'stroke-width': 2});
      const text = svg('text', {'font-size': 11, 'font-weight': 600, 'text-anchor': 'middle', 'dominant-baseline': 'central', stroke: 'none'});
      text.textContent = name;
      group.append(line, text);
      return {group, line, text};
    });
    this.triad.append(...this.arms.map(({group}) => group));
    this.bar = element('div', {class: 'bar'});
    this.words = element('div', {class: 'length'});
    host.append(this.triad, this.words, this.bar);
    host.title = 'Axes of the world; a length at the middle of the picture and the side of a cell of the grid, in the unit of length of the scene';
    this.host = host;
  }

  // A grid at right angles to `up`, around what the camera frames, and on the floor if there is one.
  lay(box, up, size) {
    const {run} = this.stage;
    const center = box.getCenter(new THREE.Vector3());
    const side = Math.abs(up.x) < 0.9 ? new THREE.Vector3(1, 0, 0) : new THREE.Vector3(0, 1, 0);
    const across = side.addScaledVector(up, -side.dot(up)).normalize();
    const along = up.clone().cross(across);
    this.cell = roundLength((2 * size) / kCells);
    const on = run.bodies.filter((body) => body.isLevel && this.#covers(body, center, across, along))
      .sort((a, b) => b.top - a.top)[0];
    const level = on ? on.top : Math.min(...this.#heights(box, up));
    const spans = [across, along].map((axis) => this.#lines(axis, center, size, on));
    const at = (u, v) => across.clone().multiplyScalar(u).addScaledVector(along, v).addScaledVector(up, level).toArray();
    const points = [];
    const [us, vs] = spans;
    for (const u of us.lines) points.push(...at(u, vs.low), ...at(u, vs.high));
    for (const v of vs.lines) points.push(...at(us.low, v), ...at(us.high, v));
    this.grid.geometry.setAttribute('position', new THREE.Float32BufferAttribute(points, 3));
  }

  #heights(box, up) {
    return [box.min, box.max].flatMap((a) => [box.min, box.max].map((b) =>
      Math.min(new THREE.Vector3(a.x, a.y, b.z).dot(up), new THREE.Vector3(a.x, b.y, b.z).dot(up))));
  }

  #covers(body, center, ...axes) {
    return axes.every((axis) => {
      const places = body.corners.map((corner) => corner.dot(axis));
      return Math.min(...places) <= center.dot(axis) && center.dot(axis) <= Math.max(...places);
    });
  }

  // Whole numbers of cells from the origin of the world, within the floor and not too far away.
  #lines(axis, center, size, on) {
    const places = on?.corners.map((corner) => corner.dot(axis));
    const reach = Math.min(1.5 * size, kMostCells * this.cell);
    const low = Math.max(center.dot(axis) - reach, places ? Math.min(...places) : -Infinity);
    const high = Math.min(center.dot(axis) + reach, places ? Math.max(...places) : Infinity);
    const lines = [];
    for (let k = Math.ceil(low / this.cell); k * this.cell <= high; ++k) lines.push(k * this.cell);
    return {low, high, lines};
  }

  setTheme(theme) {
    this.grid.material.color.set(theme === 'dark' ? 0xaab4c2 : 0x39424e);
  }

  update() {
    const {camera, canvas, realDistance: distance} = this.stage;
    this.grid.visible = this.isShown;
    this.host.hidden = !this.isShown;
    if (!this.isShown) return;
    const perLength = canvas.clientHeight / (2 * distance * Math.tan((camera.fov * Math.PI) / 360));
    const length = roundLength(kLeastBar / perLength);
    this.bar.style.width = `${(length * perLength).toFixed(1)}px`;
    const cell = (this.cell ?? length) * perLength;
    const isSeen = cell > kLeastCell && cell < canvas.clientWidth;
    this.words.textContent = isSeen ? `${lengthText(length)} · grid ${lengthText(this.cell ?? length)}` : lengthText(length);
    const inverse = camera.quaternion.clone().invert();
    this.arms.map((arm, k) => {
      const axis = new THREE.Vector3().setComponent(k, 1).applyQuaternion(inverse);
      arm.line.setAttribute('x2', (kAxisLength * axis.x).toFixed(1));
      arm.line.setAttribute('y2', (-kAxisLength * axis.y).toFixed(1));
      arm.text.setAttribute('x', ((kAxisLength + 8) * axis.x).toFixed(1));
      arm.text.setAttribute('y', (-(kAxisLength + 8) * axis.y).toFixed(1));
      arm.group.setAttribute('opacity', axis.z < -0.3 ? '0.55' : '1');
      return {arm, z: axis.z};
    }).sort((a, b) => a.z - b.z).forEach(({arm}) => this.triad.append(arm.group));
  }
}
