// SPDX-License-Identifier: BSD-3-Clause
#include "check/motion.h"

namespace dyop_check {
namespace {

constexpr double kUnit = 0x1p-53;
// Roundings in a pose and in a posed point, each of at most kUnit of a coordinate: fewer than 60 in
// a cubic, its rotation vector, Rodrigues' formula and two products; sin and cos err by at most 4.
constexpr double kPoseRoundings = 256;

struct Cubic {
  Vec value, rate, second;
};

// The cubic through two values with their rates, its rate and its second derivative.
Cubic cubic_at(double t, double t0, const Vec& x0, const Vec& v0, double t1, const Vec& x1,
               const Vec& v1) {
  const double h = t1 - t0;
  const double s = (t - t0) / h;
  const Vec d = x1 - x0;
  // x = x0 + s h v0 + s^2 (3 d - h (2 v0 + v1)) + s^3 (h (v0 + v1) - 2 d)
  const Vec c2 = 3.0 * d - h * (2.0 * v0 + v1);
  const Vec c3 = h * (v0 + v1) - 2.0 * d;
  return {x0 + s * (h * v0 + s * (c2 + s * c3)), (1 / h) * (h * v0 + s * (2.0 * c2 + (3 * s) * c3)),
          (1 / (h * h)) * (2.0 * c2 + (6 * s) * c3)};
}

Cubic place_at(const Segment& g, double t) {
  return cubic_at(t, g.first.t, g.first.p, g.first.v, g.last.t, g.last.p, g.last.v);
}

Cubic turn_at(const Segment& g, double t) {
  return cubic_at(t, g.first.t, g.first.theta, g.first.theta_rate, g.last.t, g.last.theta,
                  g.last.theta_rate);
}

double larger(const Vec& a, const Vec& b) {
  return std::max(norm(a), norm(b));
}

}  // namespace

Pose Segment::pose(double t) const {
  Pose M;
  switch (kind) {
    case Kind::Rest:
      return {R, p};
    case Kind::Twist:
      M = {rotation((t - t0) * w) * R, p + (t - t0) * v};
      break;
    case Kind::Cubic:
      M = {R * rotation(turn_at(*this, t).value), place_at(*this, t).value};
      break;
    case Kind::Absent:
    case Kind::Unsupported:
      break;
  }
  return {M.R, M.p - M.R * p_cm};
}

// With a rotation vector theta the angular velocity is J theta', in the chart, where J = 1 + (1 -
// cos a) / a^2 [theta] + (a - sin a) / a^3 [theta]^2 and a = |theta|.
Velocity Segment::velocity(double t) const {
  if (kind != Kind::Twist && kind != Kind::Cubic) return {};
  Vec v_M = v;
  Vec w_W = w;
  if (kind == Kind::Cubic) {
    const Cubic turn = turn_at(*this, t);
    const double a = norm(turn.value);
    constexpr double kSmall = 1e-2;  // literal: radians; the next term of the series is below 1e-15
    const double a2 = a * a;
    const double half = std::sin(a / 2) / (a > 0 ? a / 2 : 1);
    const double linear = a > 0 ? half * half / 2 : 0.5;
    const double square = a > kSmall ? (a - std::sin(a)) / (a * a2)
                                     : 1.0 / 6 - a2 / 120 * (1 - a2 / 42 * (1 - a2 / 72));
    const Vec across = cross(turn.value, turn.rate);
    w_W = R * (turn.rate + linear * across + square * cross(turn.value, across));
    v_M = place_at(*this, t).rate;
  }
  return {v_M - cross(w_W, pose(t).R * p_cm), w_W};
}

// A cubic's second derivative is linear in time, so it is largest at an end. Its rate is quadratic
// and lies in the hull of its Bernstein coefficients. With a rotation vector theta the angular
// speed is at most |theta'|, and the angular acceleration at most |theta''| + |theta'|^2 / pi
// (docs/algorithms/motions.md, lemma 2).
Acceleration acceleration(const Segment& segment, double begin, double end) {
  if (segment.kind == Segment::Kind::Twist) {
    const double turn = kUp * dot(segment.w, segment.w);
    return {kUp * turn * segment.lever, turn, kUp * norm(segment.w)};
  }
  if (segment.kind != Segment::Kind::Cubic) return {};
  const Cubic p0 = place_at(segment, begin);
  const Cubic p1 = place_at(segment, end);
  const Cubic q0 = turn_at(segment, begin);
  const Cubic q1 = turn_at(segment, end);
  const Vec middle = q0.rate + (0.5 * (end - begin)) * q0.second;
  const double rate = std::max(larger(q0.rate, q1.rate), norm(middle));
  constexpr double kPi = 3.141592653589793;
  // Where a difference of large numbers is nearly zero its rounding counts, too.
  const double h = segment.last.t - segment.first.t;
  const double place_noise =
      64 * kUnit *
      (larger(segment.first.p, segment.last.p) + h * larger(segment.first.v, segment.last.v)) /
      (h * h);
  const double turn_noise = 64 * kUnit *
                            (larger(segment.first.theta, segment.last.theta) +
                             h * larger(segment.first.theta_rate, segment.last.theta_rate)) /
                            (h * h);
  const double w = rate + turn_noise * h;
  const double turn = kUp * (larger(q0.second, q1.second) + w * w * (1 + 1 / kPi)) + turn_noise;
  return {kUp * (larger(p0.second, p1.second) + turn * segment.lever) + place_noise, turn, kUp * w};
}

// Times are exact, so only differences of them and what is computed with these are rounded.
double pose_noise(const Segment& segment, double size, double begin, double end) {
  double place = norm(segment.p);
  double turns = 0;
  if (segment.kind == Segment::Kind::Twist) {
    const double span = std::max(std::abs(begin - segment.t0), std::abs(end - segment.t0));
    place += span * norm(segment.v);
    turns = span * norm(segment.w);
  } else if (segment.kind == Segment::Kind::Cubic) {
    const double h = segment.last.t - segment.first.t;
    place = larger(segment.first.p, segment.last.p) + h * larger(segment.first.v, segment.last.v);
    turns = 1 + larger(segment.first.theta, segment.last.theta) +
            h * larger(segment.first.theta_rate, segment.last.theta_rate);
  }
  const double body = size + norm(segment.p_cm);
  return kPoseRoundings * kUnit * (place + (1 + turns) * body);
}

}  // namespace dyop_check
