// SPDX-License-Identifier: BSD-3-Clause
// Normals that are smooth over a curved surface and sharp across its edges.
import * as THREE from 'three';
import {edgeAttribute} from './edges.js';

const kSharp = Math.cos((35 * Math.PI) / 180);
const kManyTriangles = 20000;
const kSameNormal = 1e-5;

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

// One vertex for all corners of the same place and normal: the fewer there are, the sooner a picture of
// a thousand balls is drawn.
function share(geometry, {cornerPositions, normals, first, corners}) {
  const isSame = (a, b) => [0, 1, 2].every((i) => Math.abs(normals[3 * a + i] - normals[3 * b + i]) < kSameNormal);
  const kept = [];
  const index = new Uint32Array(corners.length);
  for (let vertex = 0; vertex + 1 < first.length; ++vertex) {
    const begin = kept.length;
    for (const corner of corners.subarray(first[vertex], first[vertex + 1])) {
      let place = begin;
      while (place < kept.length && !isSame(kept[place], corner)) place += 1;
      if (place === kept.length) kept.push(corner);
      index[corner] = place;
    }
  }
  const pick = (values) => Float32Array.from({length: 3 * kept.length}, (_, k) => values[3 * kept[Math.floor(k / 3)] + (k % 3)]);
  geometry.setAttribute('position', new THREE.BufferAttribute(pick(cornerPositions), 3));
  geometry.setAttribute('normal', new THREE.BufferAttribute(pick(normals), 3));
  geometry.setIndex(new THREE.BufferAttribute(index, 1));
  return geometry;
}

// Large meshes, those that deform and what is smooth keep one normal a vertex; what deforms in a copy.
export function cornerNormals({positions, indices, deforms}, isSmooth = false) {
  const geometry = new THREE.BufferGeometry();
  if (isSmooth || deforms || indices.length > 3 * kManyTriangles) {
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
  const edge = edgeAttribute({positions, indices}, faces, kSharp);
  // Corners of a triangle each have an edge attribute of their own; without it, they are shared.
  if (!edge) return share(geometry, {cornerPositions, normals, first, corners});
  geometry.setAttribute('position', new THREE.BufferAttribute(cornerPositions, 3));
  geometry.setAttribute('normal', new THREE.BufferAttribute(normals, 3));
  geometry.setAttribute('edge', edge);
  return geometry;
}
