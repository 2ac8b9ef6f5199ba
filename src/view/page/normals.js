// SPDX-License-Identifier: BSD-3-Clause
// Normals that are smooth over a curved surface and sharp across its edges.
import * as THREE from 'three';
import {edgeAttribute} from './edges.js';

const kSharp = Math.cos((35 * Math.PI) / 180);
const kManyTriangles = 20000;

function faceNormals({positions, indices}) {
  const normals = new Float32Array(indices.length);
  const corner = (k) => 3 * indices[k];
  for (let k = 0; k < indices.length; k += 3) {
    const [a, b, c] = [corner(k), corner(k + 1), corner(k + 2)];
    const [ux, uy, uz] = [0, 1, 2].map((i) => positions[b + i] - positions[a + i]);
    const [vx, vy, vz] = [0, 1, 2].map((i) => positions[c + i] - positions[a + i]);
    const n = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    const length = Math.hypot(...n) || 1;
    for (let i = 0; i < 3; ++i) normals[k + i] = n[i] / length;
  }
  return normals;
}

// Corners that share a vertex, as lists one after another.
function cornersOfVertices(count, indices) {
  const first = new Uint32Array(count + 1);
  for (const vertex of indices) ++first[vertex + 1];
  for (let k = 0; k < count; ++k) first[k + 1] += first[k];
  const corners = new Uint32Array(indices.length);
  const next = first.slice();
  indices.forEach((vertex, corner) => (corners[next[vertex]++] = corner));
  return {first, corners};
}

// Large meshes and those that deform keep one normal a vertex; the latter in a copy.
export function cornerNormals({positions, indices, deforms}) {
  const geometry = new THREE.BufferGeometry();
  if (deforms || indices.length > 3 * kManyTriangles) {
    const places = deforms ? positions.slice() : positions;
    geometry.setAttribute('position', new THREE.BufferAttribute(places, 3));
    geometry.setIndex(new THREE.BufferAttribute(indices, 1));
    geometry.computeVertexNormals();
    return geometry;
  }
  const faces = faceNormals({positions, indices});
  const {first, corners} = cornersOfVertices(positions.length / 3, indices);
  const cornerPositions = new Float32Array(3 * indices.length);
  const normals = new Float32Array(3 * indices.length);
  for (let k = 0; k < indices.length; ++k) {
    const vertex = indices[k];
    const face = 3 * Math.floor(k / 3);
    const sum = [0, 0, 0];
    for (let j = first[vertex]; j < first[vertex + 1]; ++j) {
      const other = 3 * Math.floor(corners[j] / 3);
      let cosine = 0;
      for (let i = 0; i < 3; ++i) cosine += faces[face + i] * faces[other + i];
      if (cosine < kSharp) continue;
      for (let i = 0; i < 3; ++i) sum[i] += faces[other + i];
    }
    const length = Math.hypot(...sum) || 1;
    for (let i = 0; i < 3; ++i) {
      cornerPositions[3 * k + i] = positions[3 * vertex + i];
      normals[3 * k + i] = sum[i] / length;
    }
  }
  geometry.setAttribute('position', new THREE.BufferAttribute(cornerPositions, 3));
  geometry.setAttribute('normal', new THREE.BufferAttribute(normals, 3));
  const edge = edgeAttribute({positions, indices}, faces, kSharp);
  if (edge) geometry.setAttribute('edge', edge);
  return geometry;
}
