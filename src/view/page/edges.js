// SPDX-License-Identifier: BSD-3-Clause
// Draws the sharp edges of flat bodies as lines, in the shader of their faces: an attribute holds, for
// each corner of a triangle, how far it is from the opposite side, in heights of the triangle; sides
// that are not sharp are far away everywhere.
import * as THREE from 'three';

const kDark = 0.42;  // of the colour of the face
const kFlat = 1e-4;  // height of a triangle, of its longest side: lower, its normal is noise

// A number for each vertex that is the same for vertices at the same place.
function weld(positions) {
  const known = new Map();
  return Uint32Array.from({length: positions.length / 3}, (_, k) => {
    const key = `${positions[3 * k]},${positions[3 * k + 1]},${positions[3 * k + 2]}`;
    if (!known.has(key)) known.set(key, known.size);
    return known.get(key);
  });
}

// The corner of a triangle opposite to its longest side, if the triangle has hardly any area.
function flatCorner({positions, indices}, first) {
  const sides = [0, 1, 2].map((corner) => {
    const [a, b] = [3 * indices[first + ((corner + 1) % 3)], 3 * indices[first + ((corner + 2) % 3)]];
    return [0, 1, 2].map((axis) => positions[b + axis] - positions[a + axis]);
  });
  const lengths = sides.map((side) => Math.hypot(...side));
  const longest = lengths.indexOf(Math.max(...lengths));
  const [u, v] = [sides[longest], sides[(longest + 1) % 3]];
  const area = Math.hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]);
  return area <= kFlat * lengths[longest] ** 2 ? longest : undefined;
}

// `normals` holds one for each triangle. Where triangles have no area, that of the neighbour at the
// longest side counts, so that no line is drawn through what is flat.
export function edgeAttribute({positions, indices}, normals, sharpCosine) {
  const place = weld(positions);
  const count = place.length;
  const sides = new Map();
  const keyOf = (k) => {
    const first = 3 * Math.floor(k / 3);
    const [a, b] = [place[indices[first + ((k + 1) % 3)]], place[indices[first + ((k + 2) % 3)]]];
    return Math.min(a, b) * count + Math.max(a, b);
  };
  for (let k = 0; k < indices.length; ++k) {
    const key = keyOf(k);
    const list = sides.get(key);
    if (list) list.push(k);
    else sides.set(key, [k]);
  }
  const faces = normals.slice();
  for (let first = 0; first < indices.length; first += 3) {
    const corner = flatCorner({positions, indices}, first);
    if (corner === undefined) continue;
    const other = sides.get(keyOf(first + corner)).find((one) => one !== first + corner);
    if (other !== undefined) faces.set(normals.subarray(other - (other % 3), other - (other % 3) + 3), first);
  }
  const isSharp = (k) => {
    const own = 3 * Math.floor(k / 3);
    const others = sides.get(keyOf(k)).filter((other) => other !== k);
    if (others.length !== 1) return true;  // the border of an open sheet, or where several meet
    const other = 3 * Math.floor(others[0] / 3);
    return faces[own] * faces[other] + faces[own + 1] * faces[other + 1] + faces[own + 2] * faces[other + 2] < sharpCosine;
  };
  const values = new Uint8Array(3 * indices.length);
  let hasAny = false;
  for (let k = 0; k < indices.length; ++k) {
    const corner = k % 3;
    const first = k - corner;
    const sharp = isSharp(k);
    hasAny ||= sharp;
    // Component `corner` of all three corners: distance from the side opposite to it.
    for (let j = 0; j < 3; ++j) values[3 * (first + j) + corner] = !sharp || j === corner ? 255 : 0;
  }
  return hasAny ? new THREE.BufferAttribute(values, 3, true) : undefined;
}

// Lets a material draw them while `isOn.value`.
export function drawEdges(material, isOn) {
  material.onBeforeCompile = (shader) => {
    shader.uniforms.drawsEdges = isOn;
    shader.vertexShader = 'attribute vec3 edge;\nvarying vec3 vEdge;\n' + shader.vertexShader.replace(
      '#include <begin_vertex>', '#include <begin_vertex>\nvEdge = edge;');
    shader.fragmentShader = 'varying vec3 vEdge;\nuniform bool drawsEdges;\n' + shader.fragmentShader.replace('#include <opaque_fragment>', `
      if (drawsEdges) {
      vec3 perPixel = fwidth(vEdge);
      vec3 pixels = vEdge / max(perPixel, vec3(1e-6));
      float height = 1.0 / max(max(perPixel.x, perPixel.y), max(perPixel.z, 1e-6));
      float line = (1.0 - smoothstep(0.5, 1.3, min(min(pixels.x, pixels.y), pixels.z))) * smoothstep(3.0, 12.0, height);
      outgoingLight *= mix(1.0, ${kDark.toFixed(2)}, line);
      diffuseColor.a = max(diffuseColor.a, 0.45 * line);
      }
      #include <opaque_fragment>`);
  };
}
