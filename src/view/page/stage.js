// SPDX-License-Identifier: BSD-3-Clause
// Draws the bodies: one instanced mesh for each shape and each manner of drawing.
import * as THREE from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';
import {deform} from './deformation.js';
import {drawEdges} from './edges.js';
import {ballsToFrame, fit} from './framing.js';
import {findFloors, Ground} from './ground.js';
import {cornerNormals} from './normals.js';

const kHues = [0x4c78a8, 0xf2903c, 0x59a86e, 0xb36bc2, 0xd9a521, 0x4fb3bf, 0xd3605f, 0x8a7462,
               0x7d8fd6, 0x9bb552, 0xc7779b, 0x6c9a8b];
const kFloor = {light: 0xb4bcc7, dark: 0x3c434e};
const kWallColor = {light: 0xd8d0c2, dark: 0x6e675b};
const kFixed = {light: 0xd9dbe0, dark: 0x838c99};
const kGiven = {light: 0x7a828e, dark: 0xa7afbb};
const kManners = ['solid', 'ghost', 'wire'];
// More are drawn coarsely while time runs or is dragged, and finely once the picture stands still:
// without a graphics card, and with one.
const kMostTriangles = {software: 60000, hardware: 2000000};
const kMostBodies = {software: 150, hardware: 20000};
const kCoarse = 0.6;  // of the resolution, while the picture moves
const kMovingPixels = [45, 11];  // largest radius at which balls of 128, of 32 triangles look round
const kMostSightLines = 40;
const kGolden = (Math.sqrt(5) - 1) / 2;
const kMostWallTriangles = 5000;
const kMostWallTests = 300000;  // of a sight line with a triangle, in one picture
const kWallTimes = 9;   // of the run, at which walls are looked for
const kOften = 0.01;    // of all sight lines
const kDrawnIn = 0.06;  // of the way to the middle, so that a body that touches a wall is not behind it
const kProbe = new THREE.MeshBasicMaterial({side: THREE.DoubleSide});
const kWall = 0.3;      // of the size: the smallest radius of a fixed body that becomes see-through
const kFieldOfView = 40;  // degrees
const kFarAway = 8;       // of the size: the camera of a close-up
const kDepth = 2.5;       // of the size: what a close-up shows before and behind the gap
const kNearest = 1e-6;  // of the size: as near as a close-up goes
const kAlone = 0.05;    // of the size: nearer, a close-up shows its pair only
const kShadow = 1.6;    // of the size: what shadows reach from the middle
const kShadowReach = 1.2;  // of the camera's distance, when it is near
const kNoShadow = 0.03;    // of the size: nearer, there are no shadows

// Slow is blue, fast is yellow.
export function heat(x, out = new THREE.Color()) {
  const stops = [[0x2c, 0x3f, 0x9e], [0x1f, 0x96, 0x9c], [0x6c, 0xc2, 0x5a], [0xfd, 0xd8, 0x35]];
  const at = Math.min(Math.max(x, 0), 1) * (stops.length - 1);
  const k = Math.min(Math.floor(at), stops.length - 2);
  const mix = stops[k].map((c, i) => (c + (at - k) * (stops[k + 1][i] - c)) / 255);
  return out.setRGB(...mix, THREE.SRGBColorSpace);
}

export function bodyColor(body, theme, out = new THREE.Color()) {
  if (body.color) return out.set(body.color);
  if (body.kind === 'static') return out.set((body.isFloor ? kFloor : body.isGround ? kWallColor : kFixed)[theme]);
  if (!body.isMover) return out.set(kGiven[theme]);
  return out.set(kHues[body.number % kHues.length]);
}

function rendering() {
  const gl = document.createElement('canvas').getContext('webgl2');
  const name = gl.getExtension('WEBGL_debug_renderer_info')?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER;
  const isSoftware = /swiftshader|llvmpipe|software/i.test(gl.getParameter(name));
  gl.getExtension('WEBGL_lose_context')?.loseContext();
  return isSoftware ? 'software' : 'hardware';
}

// At most so many of a list, spread over it without a period, which bodies in rows would share.
function someOf(list, most) {
  if (list.length <= most) return list;
  return Array.from({length: most}, (_, k) => list[Math.floor(((k * kGolden) % 1) * list.length)]);
}

// A page without controls is a picture, or a frame of a film: it may take its time.
function isPicture() {
  return new URLSearchParams(location.hash.slice(1)).get('bare') === '1';
}

export class Stage {
  constructor(canvas, run, where = document.getElementById('where')) {
    this.run = run;
    this.canvas = canvas;
    this.triangles = run.bodies.reduce((sum, {shape}) => sum + run.surfaces[shape].indices.length / 3, 0);
    const means = rendering();
    const isSmooth = this.triangles < kMostTriangles[means] || isPicture();
    this.isFine = isPicture() || (isSmooth && run.bodies.length < kMostBodies[means]);
    this.renderer = new THREE.WebGLRenderer({canvas, antialias: isSmooth, preserveDrawingBuffer: true});
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(kFieldOfView, 1, 0.01, 1000);
    // 0 solid, 1 ghost, 2 wire, 3 hidden
    this.manner = [];
    this.colors = [];
    this.shapes = [];
    this.drawsEdges = {value: true};
    this.size = 1;
    this.origin = new THREE.Vector3();  // of what is drawn, in the world
    this.grow();
    this.#addLight(isSmooth);
    this.selection = new THREE.LineSegments(new THREE.EdgesGeometry(new THREE.BoxGeometry(1, 1, 1)),
                                            new THREE.LineBasicMaterial());
    this.selection.visible = false;
    this.scene.add(this.selection);
    this.#setUp();
    this.ground = new Ground(this, where);
  }

  // Draws bodies that the run has got. They share no shape with older ones.
  grow() {
    if (this.colors.length === this.run.bodies.length) return;
    const counts = this.run.surfaces.map(() => 0);
    for (const {number, shape, ghost} of this.run.bodies) {
      counts[shape] += 1;
      this.manner[number] ??= ghost ? 1 : 0;
      this.colors[number] ??= new THREE.Color();
    }
    const first = this.shapes.length;
    const added = this.run.surfaces.slice(first).map((surface, k) => {
      const number = first + k;
      const geometry = cornerNormals(surface);
      geometry.computeBoundingBox();
      geometry.computeBoundingSphere();
      const materials = {
        solid: new THREE.MeshLambertMaterial({side: this.#sideOf(number), shadowSide: THREE.BackSide}),
        ghost: new THREE.MeshLambertMaterial({transparent: true, opacity: 0.16, depthWrite: false,
                                              side: THREE.DoubleSide}),
        wire: new THREE.MeshBasicMaterial({wireframe: true}),
      };
      if (geometry.attributes.edge) for (const name of ['solid', 'ghost']) drawEdges(materials[name], this.drawsEdges);
      const meshes = kManners.map((manner) => {
        const mesh = new THREE.InstancedMesh(geometry, materials[manner], counts[number]);
        mesh.instanceColor = new THREE.InstancedBufferAttribute(
          new Float32Array(3 * counts[number]), 3);
        mesh.frustumCulled = false;
        mesh.castShadow = manner === 'solid';
        mesh.receiveShadow = manner !== 'wire';
        mesh.userData.bodies = new Int32Array(counts[number]);
        mesh.count = 0;
        this.scene.add(mesh);
        return mesh;
      });
      const isSmooth = !geometry.attributes.edge;
      return {geometry, moving: surface.moving.map((fewer) => cornerNormals(fewer, isSmooth)), meshes};
    });
    this.shapes.push(...added);
  }

  // What has an inside is seen from outside, unless it is cut.
  #sideOf(shape) {
    const {form} = this.run.shapes[shape];
    return form && form.name !== 'half_space' && !this.cut ? THREE.FrontSide : THREE.DoubleSide;
  }

  #addLight(isSmooth) {
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x9a9a9a, 1.5));
    this.sun = new THREE.DirectionalLight(0xffffff, 1.9);
    this.sun.castShadow = this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.autoUpdate = false;
    this.sun.shadow.mapSize.setScalar(isSmooth ? 2048 : 1024);
    this.sun.shadow.radius = 4;
    // A weak light at the camera, so that no side that is seen is black.
    this.lamp = new THREE.DirectionalLight(0xffffff, 0.7);
    this.scene.add(this.sun, this.sun.target, this.lamp, this.lamp.target);
  }

  // Up is against gravity, if there is any; the camera frames what moves.
  #setUp() {
    const g = new THREE.Vector3(...this.run.gravity);
    const up = g.length() > 0 ? g.normalize().negate() : new THREE.Vector3(0, 0, 1);
    this.camera.up.copy(up);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener('start', () => (this.isFramed = false));
    this.controls.addEventListener('change', () => this.onChange?.());
  }

  frame() {
    const up = this.camera.up.clone();
    const balls = ballsToFrame(this.run, this.shapes);
    const box = new THREE.Box3();
    for (const {center} of balls) box.expandByPoint(center);
    const half = box.getSize(new THREE.Vector3());
    this.camera.fov = kFieldOfView;
    this.isCut = false;
    this.pair = undefined;
    // Look across the two largest sides that are not up.
    const axes = [new THREE.Vector3(1, 0, 0), new THREE.Vector3(0, 1, 0), new THREE.Vector3(0, 0, 1)]
      .filter((axis) => Math.abs(axis.dot(up)) < 0.7)
      .sort((a, b) => Math.abs(a.dot(half)) - Math.abs(b.dot(half)));
    const right = axes[0].clone().cross(up).dot(axes[1]) < 0 ? 1 : -1;
    const [front, {position, target, box: seen}] = this.#openView([right, -right].map((sign) => {
      const way = axes[0].clone().multiplyScalar(sign);
      const toward = way.clone().addScaledVector(axes[1], 0.55 * sign * right).addScaledVector(up, 0.38);
      return [way, fit(balls, toward.normalize(), up, this.camera.fov, this.camera.aspect)];
    }));
    this.camera.position.copy(position);
    this.controls.target.copy(target);
    const center = seen.getCenter(new THREE.Vector3());
    this.size = Math.max(seen.getSize(new THREE.Vector3()).length() / 2, 1e-30);
    this.center = center;
    this.sunward = up.clone().multiplyScalar(2.4).addScaledVector(axes[1], 0.9).addScaledVector(front, 1.5)
      .multiplyScalar(this.size);
    this.controls.update();
    findFloors(this.run, this.shapes, up);
    this.ground.lay(seen, up, this.size);
    this.framed = seen;
    if (this.cut) this.setCut(this.cut.axis, this.cut.part);
    this.isFramed = true;
  }

  setTheme(theme) {
    this.theme = theme;
    const style = getComputedStyle(document.documentElement);
    this.scene.background = new THREE.Color(style.getPropertyValue('--ground').trim());
    this.selection.material.color.set(style.getPropertyValue('--accent').trim());
    this.ground.setTheme(theme);
  }

  resize() {
    const {clientWidth, clientHeight} = this.canvas;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.renderer.setPixelRatio(this.#ratio(true));
    this.renderer.setSize(clientWidth, clientHeight, false);
    const aspect = clientWidth / clientHeight;
    const isNew = aspect !== this.camera.aspect;
    this.camera.aspect = aspect;
    this.camera.updateProjectionMatrix();
    if (isNew && this.isFramed) this.frame();
  }

  // Pixels of the picture per pixel of CSS.
  #ratio(isStill) {
    return Math.min(window.devicePixelRatio || 1, 2) * (isStill ? 1 : kCoarse);
  }

  // Puts every body where it is at time t.
  place(t) {
    const matrix = new THREE.Matrix4();
    const p = new THREE.Vector3();
    const q = new THREE.Quaternion();
    const one = new THREE.Vector3(1, 1, 1);
    for (const {meshes} of this.shapes) for (const mesh of meshes) mesh.count = 0;
    for (const deformation of this.run.deformations) {
      const {shape} = this.run.bodies[deformation.body];
      deform(deformation, this.run.surfaces[shape], this.shapes[shape].geometry, t);
    }
    const {alone} = this;
    const hidden = alone ? new Set() : this.uncover(t);
    // Single precision is kept for what is near what the camera looks at.
    this.origin.copy(this.controls.target);
    for (const body of this.run.bodies) {
      const manner = this.manner[body.number] || (hidden.has(body) ? 1 : 0);
      if (manner > 2 || (alone && !alone.includes(body.number)) || !this.run.isPresent(body, t)) continue;
      const state = this.run.state(body, t);
      const mesh = this.shapes[body.shape].meshes[manner];
      const place = mesh.count++;
      mesh.setMatrixAt(place, matrix.compose(p.fromArray(state.p).sub(this.origin), q.fromArray(state.q), one));
      mesh.setColorAt(place, this.colors[body.number]);
      mesh.userData.bodies[place] = body.number;
    }
    for (const {meshes} of this.shapes) {
      for (const mesh of meshes) {
        mesh.visible = mesh.count > 0;
        mesh.position.copy(this.origin);
        mesh.updateMatrixWorld();
        mesh.instanceMatrix.needsUpdate = mesh.instanceColor.needsUpdate = true;
        mesh.boundingSphere = null;
      }
    }
  }

  // Picks the first of two views from opposite sides, unless fixed bodies hide much less in the other.
  #openView(views) {
    const {begin, end} = this.run;
    const hiding = views.map(([, {position}]) => [0.1, 0.3, 0.5, 0.7, 0.9].reduce((sum, part) => {
      const t = begin + part * (end - begin);
      return sum + this.#inTheWay(this.#wallsAt(t), position, t).count;
    }, 0));
    return views[hiding[1] < 0.5 * hiding[0] ? 1 : 0];
  }

  #wallsAt(t) {
    return this.run.bodies.filter((body) => !body.isMover && this.run.isPresent(body, t) && !this.run.surfaces[body.shape].deforms &&
      this.run.surfaces[body.shape].indices.length < 3 * kMostWallTriangles);
  }

  // Large fixed bodies that hide any part of what moves, such as the near wall of a pit, become
  // see-through: those that do at time t, and those that often do, so that none of these is solid first.
  uncover(t) {
    const isLarge = ({radius}) => radius > kWall * this.size;
    const hidden = new Set(this.#inTheWay(this.#wallsAt(t).filter(isLarge), this.camera.position, t).lines.keys());
    const key = `${this.camera.position.toArray().map((x) => Math.round((40 * x) / this.size))} ${this.run.blocks}`;
    if (this.often?.key !== key) this.often = {key, walls: this.#oftenInTheWay(isLarge)};
    for (const wall of this.often.walls) if (this.run.isPresent(wall, t)) hidden.add(wall);
    return hidden;
  }

  #oftenInTheWay(isLarge) {
    const {begin, end} = this.run;
    const lines = new Map();
    let all = 0;
    for (let k = 0; k < kWallTimes; ++k) {
      const t = begin + ((end - begin) * k) / (kWallTimes - 1);
      const found = this.#inTheWay(this.#wallsAt(t).filter(isLarge), this.camera.position, t);
      all += found.all;
      for (const [wall, count] of found.lines) lines.set(wall, (lines.get(wall) ?? 0) + count);
    }
    return [...lines.keys()].filter((wall) => lines.get(wall) > kOften * all);
  }

  // Points all over a body, in its own frame: its outermost vertices, drawn in a little, and its middle.
  #pointsOf(shape) {
    if (shape.points) return shape.points;
    const {array} = shape.geometry.attributes.position;
    const middle = shape.geometry.boundingBox.getCenter(new THREE.Vector3());
    shape.points = [middle];
    for (let corner = 0; corner < 8; ++corner) {
      const sign = [0, 1, 2].map((axis) => ((corner >> axis) & 1 ? 1 : -1));
      let best = 0;
      let most = -Infinity;
      for (let k = 0; k < array.length; k += 3) {
        const reach = sign[0] * array[k] + sign[1] * array[k + 1] + sign[2] * array[k + 2];
        if (reach > most) [most, best] = [reach, k];
      }
      shape.points.push(new THREE.Vector3().fromArray(array, best).lerp(middle, kDrawnIn));
    }
    return shape.points;
  }

  // Which walls are before the moving bodies, seen from a place; how many sight lines each blocks, and
  // how many bodies are hidden in part.
  #inTheWay(walls, place, t) {
    const lines = new Map();
    const moving = someOf(this.run.movers.filter((body) => !body.ghost && this.run.isPresent(body, t)), kMostSightLines);
    const cost = walls.reduce((sum, {shape}) => sum + this.run.surfaces[shape].indices.length / 3, 0);
    const share = Math.max(1, Math.min(9, Math.floor(kMostWallTests / Math.max(1, cost * moving.length))));
    let count = 0;
    let all = 0;
    const ray = new THREE.Raycaster();
    const point = new THREE.Vector3();
    const turn = new THREE.Quaternion();
    const probes = walls.map((wall) => {
      const probe = new THREE.Mesh(this.shapes[wall.shape].geometry, kProbe);
      const {p, q} = this.run.state(wall, t);
      probe.position.set(...p);
      probe.quaternion.set(...q);
      probe.updateMatrixWorld();
      return probe;
    });
    for (const body of moving) {
      const {p, q} = this.run.state(body, t);
      const points = this.#pointsOf(this.shapes[body.shape]);
      let isHidden = false;
      for (const own of points.slice(0, share)) {
        point.copy(own).applyQuaternion(turn.fromArray(q));
        point.x += p[0], point.y += p[1], point.z += p[2];
        const distance = point.distanceTo(place);
        ray.set(place, point.sub(place).normalize());
        ray.far = distance;
        all += 1;
        probes.forEach((probe, number) => {
          if (ray.intersectObject(probe, false).length === 0) return;
          lines.set(walls[number], (lines.get(walls[number]) ?? 0) + 1);
          isHidden = true;
        });
      }
      count += isHidden;
    }
    return {lines, count, all};
  }

  // A frame around the box of one body.
  select(body, t) {
    this.selection.visible = body !== undefined && this.run.isPresent(body, t);
    if (!this.selection.visible) return;
    const {p, q} = this.run.state(body, t);
    const box = this.shapes[body.shape].geometry.boundingBox;
    const turn = new THREE.Quaternion(...q);
    const center = box.getCenter(new THREE.Vector3()).applyQuaternion(turn);
    this.selection.position.set(...p).add(center);
    this.selection.quaternion.copy(turn);
    this.selection.scale.copy(box.getSize(new THREE.Vector3())).multiplyScalar(1.03);
  }

  // Shadows are fine where the camera looks. Quite near there are none: their points would be seen.
  #lay(shadow, reach) {
    const middle = this.center.clone().lerp(this.controls.target, reach < kShadow * this.size ? 1 : 0);
    this.sun.target.position.copy(middle);
    this.sun.position.copy(middle).add(this.sunward);
    const {camera} = shadow;
    camera.left = camera.bottom = -reach;
    camera.right = camera.top = reach;
    camera.near = 0.1 * this.size;
    camera.far = 8 * this.size;
    shadow.bias = -1e-4;
    shadow.normalBias = 1.3e-3 * reach;
    camera.updateProjectionMatrix();
  }

  // While the picture moves, round bodies have as few triangles as leave their outlines where they are,
  // to about a pixel.
  #setFineness(isStill) {
    const perLength = (kCoarse * this.canvas.clientHeight) / (2 * this.distance * Math.tan((kFieldOfView * Math.PI) / 360));
    for (const {geometry, moving, meshes} of this.shapes) {
      if (moving.length === 0) continue;
      const pixels = perLength * geometry.boundingSphere.radius;
      const fewer = isStill ? undefined : moving[kMovingPixels.findLastIndex((most) => pixels < most)];
      for (const mesh of meshes) mesh.geometry = fewer ?? geometry;
    }
  }

  // In a large run shadows, edges, roundness and full resolution wait until the picture stands still.
  render(isStill = true) {
    const {distance} = this;
    const hasShadow = isStill && distance > kNoShadow * this.size;
    if (this.renderer.getPixelRatio() !== this.#ratio(isStill)) this.renderer.setPixelRatio(this.#ratio(isStill));
    this.#lay(this.sun.shadow, Math.min(kShadow, (kShadowReach * distance) / this.size) * this.size);
    this.sun.castShadow = hasShadow;
    this.drawsEdges.value = isStill;
    this.#setFineness(isStill);
    this.renderer.shadowMap.needsUpdate = hasShadow;
    this.ground.update();
    // Near enough for a look at a gap, far enough for the ground. What hides a gap is cut away.
    const {realDistance} = this;
    const isFar = this.camera.fov < kFieldOfView;
    const before = this.isCut ? distance : kDepth * this.size;
    this.camera.near = isFar ? Math.max(realDistance - before, 0.02 * realDistance) : realDistance * 0.02;
    this.camera.far = isFar ? realDistance + kDepth * this.size : (realDistance + this.size) * 60;
    this.lamp.position.copy(this.camera.position);
    this.lamp.target.position.copy(this.controls.target);
    this.camera.updateProjectionMatrix();
    this.renderer.render(this.scene, this.camera);
  }

  // How far the camera is from what it turns about.
  get realDistance() {
    return this.camera.position.distanceTo(this.controls.target);
  }

  // From where an ordinary camera would see as much: a close-up looks through a telescope.
  get distance() {
    return (this.realDistance * Math.tan((this.camera.fov * Math.PI) / 360)) / Math.tan((kFieldOfView * Math.PI) / 360);
  }

  // The bodies of a close-up, as numbers: what is behind a gap would be taken for its sides.
  get alone() {
    return this.camera.fov < kFieldOfView && this.distance < kAlone * this.size ? this.pair?.flat() : undefined;
  }

  // Moves the camera along with what it looks at.
  shift(offset) {
    this.isFramed = false;
    this.camera.position.add(offset);
    this.controls.target.add(offset);
    this.controls.update();
  }

  // Looks along a gap, as large as its width asks for, from far away through a telescope: from near by,
  // what lies behind would close the gap, as rails meet at the horizon. `pair` are the bodies on
  // either side.
  closeUp(pa, pb, width, pair) {
    this.isFramed = false;
    this.pair = pair;
    const [from, to] = [new THREE.Vector3(...pa), new THREE.Vector3(...pb)];
    const across = to.clone().sub(from).normalize();
    const direction = this.camera.position.clone().sub(this.controls.target).normalize();
    const distance = Math.min(Math.max(12 * width, kNearest * this.size), 0.5 * this.size);
    const middle = from.add(to).multiplyScalar(0.5);
    this.controls.target.copy(middle);
    const away = kFarAway * this.size;
    const gap = {middle, across, width};
    const free = this.#openSide(gap, direction, away, 2 * away) ?? this.#openSide(gap, direction, away);
    this.isCut = !free;
    const level = direction.clone().addScaledVector(across, -direction.dot(across)).normalize();
    const along = free ?? this.#openSide(gap, direction, distance) ?? level;
    this.camera.fov = (360 / Math.PI) * Math.atan((distance / away) * Math.tan((kFieldOfView * Math.PI) / 360));
    this.camera.position.copy(middle).addScaledVector(along, away);
    this.controls.update();
  }

  // A direction along a gap, near `direction`, from which it is seen `distance` away: neither body
  // stands before its middle, or behind it up to `far` away, nor one before the edge of the other.
  #openSide({middle, across, width}, direction, distance, far = distance) {
    const first = direction.clone().addScaledVector(across, -direction.dot(across));
    if (first.length() < 0.1) first.copy(this.camera.up).cross(across);
    first.normalize();
    const meshes = this.shapes.flatMap(({meshes: all}) => all.filter((mesh) => mesh.count > 0));
    const turns = [0, 1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 6, -6, 7, -7, 8];
    const sides = turns.map((k) => first.clone().applyAxisAngle(across, (k * Math.PI) / 8));
    const ray = new THREE.Raycaster();
    const seenAt = (offset, side) => {
      const place = middle.clone().addScaledVector(across, offset * width);
      ray.far = offset === 0 ? far : distance;
      ray.set(place.addScaledVector(side, distance), side.clone().negate());
      return ray.intersectObjects(meshes, false)
        .map(({object, instanceId}) => object.userData.bodies[instanceId]).find((body) => this.pair.flat().includes(body));
    };
    const [a, b] = this.pair;
    return sides.find((side) => seenAt(0, side) === undefined && !b.includes(seenAt(-1, side)) && !a.includes(seenAt(1, side)));
  }

  // The body under a point of the canvas.
  pick(x, y) {
    return this.pickPoint(x, y)?.body;
  }

  // The same with the place that is seen there. What the cut takes away is not met.
  pickPoint(x, y) {
    const {clientWidth, clientHeight} = this.canvas;
    const ray = new THREE.Raycaster();
    ray.setFromCamera(new THREE.Vector2((2 * x) / clientWidth - 1, 1 - (2 * y) / clientHeight),
                      this.camera);
    const meshes = this.shapes.flatMap(({meshes: all}) => all.filter(
      (mesh, manner) => mesh.count > 0 && manner !== 1));
    const first = (list) => ray.intersectObjects(list, false)
      .find(({point}) => !this.cut || this.cut.plane.distanceToPoint(point) >= 0);
    // See-through bodies are chosen only where nothing else is.
    const ghosts = this.shapes.map(({meshes: all}) => all[1]).filter((mesh) => mesh.count > 0);
    const hit = first(meshes) ?? first(ghosts);
    return hit && {body: this.run.bodies[hit.object.userData.bodies[hit.instanceId]], point: hit.point.toArray()};
  }

  // Takes away all that is above `part` (0 to 1) of what is framed, along an axis (0, 1, 2); no axis: nothing.
  setCut(axis, part) {
    this.cut = undefined;
    if (axis !== undefined) {
      const normal = new THREE.Vector3().setComponent(axis, -1);
      const {min, max} = this.framed;
      const [low, high] = [min.getComponent(axis), max.getComponent(axis)];
      this.cut = {axis, part, plane: new THREE.Plane(normal, low + part * (high - low))};
    }
    this.renderer.clippingPlanes = this.cut ? [this.cut.plane] : [];
    this.shapes.forEach(({meshes: [{material}]}, number) => {
      material.side = this.#sideOf(number);
      material.needsUpdate = true;
    });
  }

  // Where a point of the world is on the canvas, in its CSS pixels.
  project(point) {
    const v = new THREE.Vector3(...point).project(this.camera);
    return {
      x: ((v.x + 1) / 2) * this.canvas.clientWidth,
      y: ((1 - v.y) / 2) * this.canvas.clientHeight,
      visible: v.z > -1 && v.z < 1,
    };
  }
}
