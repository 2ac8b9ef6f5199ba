// SPDX-License-Identifier: BSD-3-Clause
// Meshes that deform: vertices plus a sum of displacement fields, with weights over time.
import {readRounded} from './blocks.js';
import {lastAtMost} from './store.js';

export function readDeformation(block, number) {
  const deformation = {body: block.deformations[number].body, times: [], rows: [], modes: []};
  growDeformation(deformation, block, number);
  return deformation;
}

// What follows: more modes, and times whose weights are of all modes known then.
export function growDeformation({times, rows, modes}, block, number) {
  const name = `deformation${number}`;
  block.deformations[number].modes.forEach((box, k) => modes.push(readRounded(block.columns[`${name}.mode${k}`], box)));
  const [more, weights] = [block.columns[`${name}.t`], block.columns[`${name}.weights`]];
  const count = weights.length / more.length;
  more.forEach((t, k) => {
    times.push(t);
    rows.push(weights.subarray(k * count, (k + 1) * count));
  });
}

// The weights at time t: linear between the times, constant outside. A mode that was not known yet has
// the weight zero.
export function weightsAt({times, rows, modes}, t) {
  const last = times.length - 1;
  const k = Math.min(Math.max(lastAtMost(times, times.length, t), 0), last);
  const next = Math.min(k + 1, last);
  const s = next > k ? Math.min(Math.max((t - times[k]) / (times[next] - times[k]), 0), 1) : 0;
  return modes.map((_, mode) => (1 - s) * (rows[k][mode] ?? 0) + s * (rows[next][mode] ?? 0));
}

// Moves the vertices of a geometry to where they are at time t.
export function deform(deformation, surface, geometry, t) {
  const weights = weightsAt(deformation, t);
  if (deformation.shown?.length === weights.length && deformation.shown.every((w, k) => w === weights[k])) return;
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
