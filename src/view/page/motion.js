// SPDX-License-Identifier: BSD-3-Clause
// Evaluates motions in double precision from the parameters that the library moves bodies by.
// Quaternions are [x, y, z, w]; columns of vectors hold all x, then all y, then all z.

export function newState() {
  return {p: [0, 0, 0], q: [0, 0, 0, 1], v: [0, 0, 0], w: [0, 0, 0]};
}

function vectorAt(column, row, out) {
  const count = column.length / 3;
  out[0] = column[row];
  out[1] = column[count + row];
  out[2] = column[2 * count + row];
  return out;
}

export function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

export function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// The vector turned by the quaternion.
export function turned(q, v) {
  const half = cross(q, v).map((x) => 2 * x);
  const more = cross(q, half);
  return [0, 1, 2].map((k) => v[k] + q[3] * half[k] + more[k]);
}

export function times(a, b, out) {
  const [ax, ay, az, aw] = a;
  const [bx, by, bz, bw] = b;
  out[0] = aw * bx + ax * bw + ay * bz - az * by;
  out[1] = aw * by - ax * bz + ay * bw + az * bx;
  out[2] = aw * bz + ax * by - ay * bx + az * bw;
  out[3] = aw * bw - ax * bx - ay * by - az * bz;
  return out;
}

// The quaternion of a rotation vector.
export function exponential(x, y, z) {
  const angle = Math.hypot(x, y, z);
  const factor = angle > 1e-4 ? Math.sin(angle / 2) / angle : 0.5 - (angle * angle) / 48;
  return [x * factor, y * factor, z * factor, Math.cos(angle / 2)];
}

const start = {p: [0, 0, 0], q: [0, 0, 0, 1], v: [0, 0, 0], w: [0, 0, 0]};

function readPose(c, row) {
  vectorAt(c.p, row, start.p);
  vectorAt(c.q, row, start.q);
  start.q[3] = c.qw[row];
}

function rest(c, row, t, out) {
  readPose(c, row);
  for (let k = 0; k < 3; ++k) {
    out.p[k] = start.p[k];
    out.v[k] = out.w[k] = 0;
  }
  for (let k = 0; k < 4; ++k) out.q[k] = start.q[k];
}

function twist(c, row, t, out) {
  readPose(c, row);
  vectorAt(c.v, row, out.v);
  vectorAt(c.w, row, out.w);
  const tau = t - c.t0[row];
  for (let k = 0; k < 3; ++k) out.p[k] = start.p[k] + tau * out.v[k];
  times(exponential(tau * out.w[0], tau * out.w[1], tau * out.w[2]), start.q, out.q);
}

function screw(c, row, t, out) {
  readPose(c, row);
  const tau = t - c.t0[row];
  const axis = vectorAt(c.axis, row, [0, 0, 0]);
  const point = vectorAt(c.point, row, [0, 0, 0]);
  const [rate, slide] = [c.turn_rate[row], c.slide_rate[row]];
  const turn = exponential(tau * rate * axis[0], tau * rate * axis[1], tau * rate * axis[2]);
  const from = [0, 1, 2].map((k) => start.p[k] - point[k]);
  const along = dot(axis, from);
  const arm = turned(turn, [0, 1, 2].map((k) => from[k] - along * axis[k]));
  const round = cross(axis, arm);
  for (let k = 0; k < 3; ++k) {
    out.p[k] = point[k] + (along + tau * slide) * axis[k] + arm[k];
    out.v[k] = slide * axis[k] + rate * round[k];
    out.w[k] = rate * axis[k];
  }
  times(turn, start.q, out.q);
}

const theta = [0, 0, 0];
const thetaRate = [0, 0, 0];

// One component of a cubic through values and rates at both ends; a is subtracted first, so that
// positions far from the origin keep their digits.
function hermite(a, va, b, vb, h, s, k, value, rate) {
  const b1 = (h / 3) * va;
  const b3 = b - a;
  const b2 = b3 - (h / 3) * vb;
  const r = 1 - s;
  value[k] = a + 3 * r * r * s * b1 + 3 * r * s * s * b2 + s * s * s * b3;
  rate[k] = (3 / h) * (r * r * b1 + 2 * r * s * (b2 - b1) + s * s * (b3 - b2));
}

function cubic(c, row, t, out) {
  readPose(c, row);
  const h = c.domain_end[row] - c.domain_begin[row];
  const s = (t - c.domain_begin[row]) / h;
  const count = c.body.length;
  for (let k = 0, at = row; k < 3; ++k, at += count) {
    hermite(c.p0[at], c.v0[at], c.p1[at], c.v1[at], h, s, k, out.p, out.v);
    hermite(c.theta0[at], c.theta_rate0[at], c.theta1[at], c.theta_rate1[at], h, s, k, theta,
            thetaRate);
  }
  times(start.q, exponential(theta[0], theta[1], theta[2]), out.q);
  // w = R_WC J(theta) theta', J = 1 + (1 - cos a)/a^2 [theta] + (a - sin a)/a^3 [theta]^2.
  const a = Math.hypot(theta[0], theta[1], theta[2]);
  const first = a > 1e-3 ? (1 - Math.cos(a)) / (a * a) : 0.5 - (a * a) / 24;
  const second = a > 1e-3 ? (a - Math.sin(a)) / (a * a * a) : 1 / 6 - (a * a) / 120;
  const once = cross(theta, thetaRate);
  const twice = cross(theta, once);
  const w = turned(start.q, [0, 1, 2].map((k) => thetaRate[k] + first * once[k] + second * twice[k]));
  for (let k = 0; k < 3; ++k) out.w[k] = w[k];
}

export const kKinds = ['rest', 'twist', 'screw', 'cubic', 'absent'];
const kEvaluate = [rest, twist, screw, cubic];

// The state of the body's frame B. `columns` are those of the segment's kind; `center` is the centre
// of mass in B, which the motion of a central segment is about.
export function evaluate(kind, columns, row, t, center, out) {
  kEvaluate[kind](columns, row, t, out);
  if (columns.central[row] === 0) return out;
  const arm = turned(out.q, center);
  const speed = cross(out.w, arm);
  for (let k = 0; k < 3; ++k) {
    out.p[k] -= arm[k];
    out.v[k] -= speed[k];
  }
  return out;
}
