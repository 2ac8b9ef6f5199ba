// SPDX-License-Identifier: BSD-3-Clause
// Meshes that deform: vertices plus a sum of displacement fields, with weights over time.
import {readRounded} from './blocks.js';
import {lastAtMost} from './run.js';

export function readDeformation(block, number) {
  const {body, modes} = block.deformations[number];
  const name = `deformation${number}`;
  return {
    body,
    times: block.columns[`${name}.t`],
    weights: block.columns[`${name}.weights`],
    modes: modes.map((box, k) => readRounded(block.columns[`${name}.mode${k}`], box)),
  };
}

// The weights at time t: linear between the times, constant outside.
export function weightsAt({times, weights, modes}, t) {
  const count = modes.length;
  const last = times.length - 1;
  const k = Math.min(Math.max(lastAtMost(times, times.length, t), 0), last);
  const next = Math.min(k + 1, last);
  const s = next > k ? Math.min(Math.max((t - times[k]) / (times[next] - times[k]), 0), 1) : 0;
  return modes.map((_, mode) =>
    (1 - s) * weights[k * count + mode] + s * weights[next * count + mode]);
}

// Moves the vertices of a geometry to where they are at time t.
export function deform(deformation, surface, geometry, t) {
  const weights = weightsAt(deformation, t);
  if (deformation.shown?.every((w, k) => w === weights[k])) return;
  deformation.shown = weights;
  const {array} = geometry.attributes.position;
  array.set(surface.positions);
  deformation.modes.forEach((mode, m) => {
    const weight = weights[m];
    for (let k = 0; k < array.length; ++k) array[k] += weight * mode[k];
  });
  geometry.attributes.position.needsUpdate = true;
  geometry.computeVertexNormals();
  geometry.computeBoundingBox();
  geometry.computeBoundingSphere();
}
