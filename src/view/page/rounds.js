// SPDX-License-Identifier: BSD-3-Clause
// Round bodies in a close-up: a fine patch of the exact surface around the nearest point, over the
// facets that are good enough from afar. Facets of a sphere are up to 2e-4 of its radius inside it.
import * as THREE from 'three';

const kSectors = 96;
const kRings = 72;
const kFinest = 1e-3;  // of the camera's distance: radius of the innermost ring
const kWidest = 0.5;   // of the body's radius: where the facets take over

const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

// The point of a box nearest to p, moved outwards by `radius` towards p.
function ofBox(p, half, radius) {
  const core = p.map((x, k) => clamp(x, -half[k], half[k]));
  const out = p.map((x, k) => x - core[k]);
  const length = Math.hypot(...out);
  return length > 0 ? core.map((x, k) => x + (radius / length) * out[k]) : p;
}

// In a half plane through the axis: the point of a cone's outline nearest to (r, z).
function ofConeOutline(r, z, radius, half) {
  const s = clamp((-r * radius + (half - z) * 2 * half + radius * 2 * r) / (radius * radius + 4 * half * half), 0, 1);
  const side = [s * radius, half - 2 * half * s];
  const base = [clamp(r, 0, radius), -half];
  const far = ([x, y]) => Math.hypot(x - r, y - z);
  return far(side) <= far(base) ? side : base;
}

// For a point outside a shape or on it: one of the shape's surface, the same if it is on it. The
// numbers are those of the scene file.
const kOnto = {
  sphere: (p, [radius]) => p.map((x) => (x * radius) / Math.hypot(...p)),
  capsule: (p, [radius, half]) => ofBox(p, [0, 0, half], radius),
  rounded_box: (p, [x, y, z, radius]) => ofBox(p, [x, y, z], radius),
  ellipsoid: (p, axes) => {
    const size = Math.hypot(...p.map((x, k) => x / axes[k]));
    return p.map((x) => x / size);
  },
  // Of balls between the ends the one on whose normal p lies.
  tapered_capsule: (p, [bottom, top, half]) => {
    const lean = (bottom - top) / (2 * half);
    const r = Math.hypot(p[0], p[1]);
    const z = clamp(p[2] - (r * lean) / Math.sqrt(1 - lean * lean), -half, half);
    const radius = bottom + ((z + half) / (2 * half)) * (top - bottom);
    const length = Math.hypot(r, p[2] - z);
    return [(p[0] * radius) / length, (p[1] * radius) / length, z + ((p[2] - z) * radius) / length];
  },
  rounded_cylinder: (p, [radius, half, edge]) => {
    const core = kOnto.cylinder(p, [radius, half]);
    const out = p.map((x, k) => x - core[k]);
    const length = Math.hypot(...out);
    return length > 0 ? core.map((x, k) => x + (edge / length) * out[k]) : p;
  },
  cylinder: (p, [radius, half]) => {
    const r = Math.hypot(p[0], p[1]);
    const scale = r > radius ? radius / r : 1;
    return [p[0] * scale, p[1] * scale, clamp(p[2], -half, half)];
  },
  cone: (p, [radius, half]) => {
    const r = Math.hypot(p[0], p[1]);
    const [near, z] = ofConeOutline(r, p[2], radius, half);
    return r > 0 ? [(p[0] * near) / r, (p[1] * near) / r, z] : [near, 0, z];
  },
};

// A point of the surface near p, which is in the frame of the shape; undefined if it is not round.
export function ontoSurface(form, p) {
  return kOnto[form?.name]?.(p, form.values);
}

// Rings of points of the surface around `center`, as offsets from it, and triangles between them.
function ringsAround(form, center, normal, finest, widest) {
  const across = Math.abs(normal[0]) < 0.6 ? [1, 0, 0] : [0, 1, 0];
  const n = new THREE.Vector3(...normal);
  const u = new THREE.Vector3(...across).cross(n).normalize();
  const v = n.clone().cross(u);
  const positions = [0, 0, 0];
  const indices = [];
  for (let ring = 0; ring < kRings; ++ring) {
    const radius = finest * (widest / finest) ** (ring / (kRings - 1));
    for (let k = 0; k < kSectors; ++k) {
      const angle = (2 * Math.PI * k) / kSectors;
      const [x, y] = [radius * Math.cos(angle), radius * Math.sin(angle)];
      const flat = center.map((c, i) => c + x * u.getComponent(i) + y * v.getComponent(i));
      positions.push(...ontoSurface(form, flat).map((c, i) => c - center[i]));
      const [here, next] = [1 + ring * kSectors + k, 1 + ring * kSectors + ((k + 1) % kSectors)];
      if (ring === 0) indices.push(0, here, next);
      else indices.push(here - kSectors, here, next, here - kSectors, next, next - kSectors);
    }
  }
  return {positions, indices};
}

export class Rounds {
  constructor(stage) {
    this.stage = stage;
    this.patches = [0, 1].map(() => {
      const material = new THREE.MeshLambertMaterial({side: THREE.DoubleSide, polygonOffset: true,
                                                      polygonOffsetFactor: -1, polygonOffsetUnits: -4});
      const mesh = new THREE.Mesh(new THREE.BufferGeometry(), material);
      mesh.frustumCulled = false;
      mesh.visible = false;
      mesh.raycast = () => {};
      stage.scene.add(mesh);
      return mesh;
    });
  }

  // `shown` is the pair whose nearest points are drawn.
  update(shown, t) {
    const {run} = this.stage;
    const ends = shown && Number.isFinite(shown.pa?.[0]) ? [[shown.a, shown.pa, shown.pb], [shown.b, shown.pb, shown.pa]] : [];
    this.patches.forEach((mesh, k) => {
      mesh.visible = false;
      if (!ends[k]) return;
      const body = run.bodies[ends[k][0]];
      const form = run.shapes[body.shape].form;
      const isNear = this.stage.distance < 2 * kWidest * body.radius;
      if (isNear && kOnto[form?.name] && this.stage.manner[body.number] === 0 && run.isPresent(body, t)) {
        this.#lay(mesh, body, form, ends[k][1], ends[k][2], t);
      }
    });
  }

  // Around the point that the exact surface has nearest to p.
  #lay(mesh, body, form, p, other, t) {
    const {p: place, q} = this.stage.run.state(body, t);
    const turn = new THREE.Quaternion(...q);
    const own = (point) => new THREE.Vector3(...point.map((x, k) => x - place[k])).applyQuaternion(turn.clone().invert());
    const seen = own(p);
    const normal = own(other).sub(seen).normalize().toArray();
    const center = ontoSurface(form, seen.toArray());
    if (!normal.every(Number.isFinite) || !center.every(Number.isFinite)) return;
    const {positions, indices} = ringsAround(form, center, normal, kFinest * this.stage.distance, kWidest * body.radius);
    mesh.geometry.setAttribute('position', new THREE.Float32BufferAttribute(positions, 3));
    mesh.geometry.setIndex(indices);
    mesh.geometry.computeVertexNormals();
    mesh.position.set(...place).add(new THREE.Vector3(...center).applyQuaternion(turn));
    mesh.quaternion.copy(turn);
    mesh.material.color.copy(this.stage.colors[body.number]);
    mesh.visible = true;
  }
}
