// SPDX-License-Identifier: BSD-3-Clause
// Where the camera stands so that what happens fills the picture.
import * as THREE from 'three';
import {jointPoints} from './links.js';

const kTimes = 24;
const kMostPlaces = 6000;
const kLost = 0.08;     // part of the places, at either end of an axis, that need not be seen
const kAfterMeeting = 0.1;  // of the run's time
const kFarOff = 2.2;
const kMargin = 1.06;
const kToolbar = 0.93;  // part of the height that the title and the buttons leave free

// The ball around a body's surface at time t.
function ballOf(run, shapes, body, t) {
  const {p, q} = run.state(body, t);
  const {center, radius} = shapes[body.shape].geometry.boundingSphere;
  const middle = center.clone().applyQuaternion(new THREE.Quaternion(...q));
  return {center: middle.add(new THREE.Vector3(...p)), radius};
}

function quantile(sorted, part) {
  return sorted[Math.round(part * (sorted.length - 1))];
}

// Leaves out balls that are far off along an axis, such as a body that falls for ever. Those of the
// beginning stay.
function withoutLost(balls, firsts) {
  let kept = balls;
  for (const axis of ['x', 'y', 'z']) {
    const sorted = balls.map(({center}) => center[axis]).sort((a, b) => a - b);
    const low = quantile(sorted, kLost);
    const high = quantile(sorted, 1 - kLost);
    const reach = 0.35 * (high - low);
    kept = kept.filter(({center, radius}) =>
      center[axis] >= low - reach - radius && center[axis] <= high + reach + radius);
  }
  return [...firsts, ...kept];
}

// Balls around moving bodies, from the beginning to time `end`.
function ballsUntil(run, shapes, moving, end) {
  const times = Math.max(2, Math.min(kTimes, Math.floor(kMostPlaces / Math.max(1, moving.length))));
  const balls = [];
  const firsts = [];
  for (let k = 0; k <= times; ++k) {
    const t = run.begin + ((end - run.begin) * k) / times;
    for (const body of moving) {
      if (run.isPresent(body, t)) (k === 0 ? firsts : balls).push(ballOf(run, shapes, body, t));
    }
  }
  return withoutLost(balls.length > 0 ? balls : firsts, firsts);
}

function boxOf(balls) {
  const box = new THREE.Box3();
  for (const {center, radius} of balls) {
    box.expandByPoint(center.clone().addScalar(radius));
    box.expandByPoint(center.clone().addScalar(-radius));
  }
  return box;
}

const sizeOf = (balls) => boxOf(balls).getSize(new THREE.Vector3()).length();

// Balls that the picture should hold: of moving bodies over time, and of small fixed bodies they hit.
// What flies off after the last pair has met for the first time may leave the picture.
export function ballsToFrame(run, shapes) {
  const moving = run.movers;
  let kept = ballsUntil(run, shapes, moving, run.end);
  const met = run.lastMeeting() + kAfterMeeting * (run.end - run.begin);
  if (met > run.begin && met < run.end) {
    const early = ballsUntil(run, shapes, moving, met);
    if (sizeOf(kept) > kFarOff * sizeOf(early)) kept = early;
  }
  const fixed = run.bodies.filter((body) => !body.isMover && run.isPresent(body, run.begin) &&
    (moving.length === 0 || (!body.isGround && run.meets(body))));
  kept.push(...jointPoints(run).map((p) => ({center: new THREE.Vector3(...p), radius: 0})));
  kept.push(...fixed.map((body) => ballOf(run, shapes, body, run.begin)));
  return kept.length > 0 ? kept : [{center: new THREE.Vector3(), radius: 1}];
}

// Along one axis of the picture: the least distance at which all balls are seen, and the middle.
function span(balls, across, toward, tan) {
  const slant = Math.hypot(1, tan);
  let high = -Infinity;
  let low = Infinity;
  for (const {center, radius} of balls) {
    const place = center.dot(across);
    const depth = center.dot(toward) * tan;
    high = Math.max(high, place + radius * slant + depth);
    low = Math.min(low, place - radius * slant - depth);
  }
  return {reach: (high - low) / (2 * tan), middle: (high + low) / 2};
}

// The camera that looks along -toward and sees all balls: its place and what it turns about.
export function fit(balls, toward, up, fov, aspect) {
  const right = up.clone().cross(toward).normalize();
  const top = toward.clone().cross(right).normalize();
  const tan = Math.tan((fov * Math.PI) / 360);
  const wide = span(balls, right, toward, tan * aspect);
  const high = span(balls, top, toward, tan * kToolbar);
  // `reach` is the depth of the camera along `toward`, seen from the origin.
  const box = boxOf(balls);
  const depth = box.getCenter(new THREE.Vector3()).dot(toward);
  const reach = Math.max(wide.reach, high.reach);
  const target = right.multiplyScalar(wide.middle).addScaledVector(top, high.middle)
    .addScaledVector(toward, depth);
  return {target, position: target.clone().addScaledVector(toward, kMargin * (reach - depth)), box};
}
