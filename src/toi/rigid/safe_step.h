// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <span>

#include "dyop/core/types.h"
#include "dyop/geometry/convex_shape.h"
#include "dyop/hierarchy/mesh_hierarchy.h"
#include "toi/rigid/box_steps.h"

namespace dyop::toi_internal {

/// A body at one instant: its pose and twist, both in world.
struct BodyInstant {
  Matrix3 R_WB;
  Vector3 p_WB;
  Vector3 v_WB;
  Vector3 w_WB;
};

/// Two bodies at one instant t, and what bounds their motion on [t, t + horizon] and on
/// [t, t + remaining] with horizon <= remaining.
struct PairInstant {
  BodyInstant a;
  BodyInstant b;
  Scalar remaining = 0;            ///< time from t to the end of the query
  Scalar horizon = 0;              ///< time for which the accelerations below hold
  Scalar linear_acceleration = 0;  ///< sum over both bodies; may be infinite
  Scalar angular_acceleration_a = 0;
  Scalar angular_acceleration_b = 0;
  Scalar linear_speed = 0;     ///< sum over both bodies, over `remaining`
  Scalar angular_speed_a = 0;  ///< over `remaining`
  Scalar angular_speed_b = 0;
  Scalar noise = 0;  ///< rounding allowance of a gap, length
};

/// The largest w . x over a box, in the shape's frame.
inline Scalar largest_along(const OrientedBox& box, const Vector3& w) {
  return w.dot(box.center) + (box.axes.transpose() * w).cwiseAbs().dot(box.half_extents);
}

/// The largest w . x over a triangle.
inline Scalar largest_along(const Triangle& triangle, const Vector3& w) {
  return std::max(w.dot(triangle[0]), std::max(w.dot(triangle[1]), w.dot(triangle[2])));
}

/// The largest w . x over a convex shape.
inline Scalar largest_along(const ConvexShape& shape, const Vector3& w) {
  const Scalar radius = shape.rounding_radius();
  return shape.core_reach(w) + (radius > 0 ? radius * w.norm() : 0);
}

/// First root in (0, h] of the quadratic with Bernstein coefficients c0 > 0, c1, c2 on [0, h],
/// rounded down; infinity if it stays positive on [0, h].
Scalar first_root(Scalar c0, Scalar c1, Scalar c2, Scalar h);

/// A unit direction from A to B that turns in world: n(s) = exp(s [turn]) n, turn normal to n.
struct TurningNormal {
  Vector3 n_W = Vector3::UnitX();
  Vector3 turn_W = Vector3::Zero();
};

/// Such a direction in the frame of a body, as both turn: n(s) . R(s) x = n_B(s) . x with n_B(s) =
/// n + s k + s^2/2 m + remainder (docs/algorithms/time_of_impact.md).
struct TurningDirection {
  Vector3 n_B;  ///< n, k and m in the body's frame
  Vector3 k_B = Vector3::Zero();
  Vector3 m_B = Vector3::Zero();
  Scalar third = 0;  ///< bound on the norm of the third derivative
  Scalar rate = 0;   ///< how fast n_B(s) can turn, radians per time

  TurningDirection(const BodyInstant& body, const TurningNormal& normal) {
    const Vector3& n_W = normal.n_W;
    const Vector3& w_W = body.w_WB;
    n_B = body.R_WB.transpose() * n_W;
    if (w_W.isZero(0) && normal.turn_W.isZero(0)) return;
    const Scalar w_norm = w_W.norm();
    const Scalar turn_norm = normal.turn_W.norm();
    const Vector3 relative_W = normal.turn_W - w_W;
    const Vector3 k_W = relative_W.cross(n_W);
    const Vector3 m_W = relative_W.cross(normal.turn_W.cross(n_W)) - w_W.cross(k_W);
    k_B = body.R_WB.transpose() * k_W;
    m_B = body.R_WB.transpose() * m_W;
    rate = w_norm + turn_norm;
    third = turn_norm > 0 ? relative_W.norm() * rate * rate : w_norm * w_norm * k_W.norm();
  }
  Vector3 at(Scalar u, Scalar q) const { return n_B + u * k_B + q * m_B; }
};

/// The turn that keeps a normal perpendicular to edges of both bodies, up to two of each, as they
/// turn; if edges contradict each other, to some of them. Only a guess is needed: a bound holds
/// along any direction. Zero without edges.
Vector3 turn_with_edges(const Vector3& n_W, std::span<const Vector3> edges_a, const Vector3& w_WA,
                        std::span<const Vector3> edges_b, const Vector3& w_WB);

/// Bounds on a gap beyond the second-order terms of constant twists: after s it has shrunk by at
/// most jerk s^3 / 6 + acceleration s^2 / 2 more.
struct MotionRemainder {
  Scalar jerk = 0;
  Scalar acceleration = 0;
  Scalar turn = 0;  ///< how fast the direction turns in a body's frame
};

/// How long two pieces of two moving bodies are proven to stay more than `floor` apart.
struct SafeStep {
  Scalar gap = 0;   ///< slab gap along n at the instant, minus floor, rounded down
  Scalar time = 0;  ///< safe for this long, rounded down; infinite: to the end of the query
};

/// A direction and what is known about it at the instant.
struct Slab {
  TurningNormal normal;
  Scalar gap = 0;  ///< slab gap along the normal, rounded down
  Scalar closing =
      0;  ///< guess of the rate at which it shrinks: decides which times are tried first
};

/// How long two points, p apart and moving by v relative to each other without acceleration, stay
/// more than `reach` apart, up to h, rounded down; 0 if they are not that far apart now.
Scalar safe_time_of_points(const Vector3& p, const Vector3& v, Scalar reach, Scalar h);

/// How long two balls about the body origins stay more than `floor` apart, within the horizon.
/// Without acceleration exact up to rounding.
Scalar safe_time_of_balls(const PairInstant& pair, Scalar radius_a, Scalar radius_b, Scalar floor);

/// The safe step of two bodies that are such balls.
SafeStep safe_step_of_balls(const PairInstant& pair, Scalar radius_a, Scalar radius_b,
                            Scalar floor);

/// Finds a safe step along a direction, by the coupled second-order bound and the bounds without a
/// direction.
///
/// @param radius_a, radius_b  Largest distance of a point of each piece from its body's origin.
template <typename PieceA, typename PieceB>
SafeStep safe_step(const PairInstant& pair, const PieceA& a, Scalar radius_a, const PieceB& b,
                   Scalar radius_b, const TurningNormal& normal, Scalar floor);

/// The same along a direction whose gap is known.
template <typename PieceA, typename PieceB>
SafeStep safe_step(const PairInstant& pair, const PieceA& a, Scalar radius_a, const PieceB& b,
                   Scalar radius_b, const Slab& slab, Scalar floor);

// --- implementation -----------------------------------------------------------------------------

/// The part of safe_step() that does not depend on the kind of piece: the gap is given as a concave
/// function G(u, q) of the turning parameters.
///
/// @param first Length of the step that is tried first.
template <typename Gap>
SafeStep coupled_step(const PairInstant& pair, Scalar gap, Scalar first,
                      const MotionRemainder& rest, const Gap& gap_at) {
  constexpr int kTrials = 8;
  SafeStep step;
  step.gap = gap < kInfinity ? gap : 0;  // overflow proves nothing
  if (!(step.gap > 0)) return step;
  Scalar h = first;
  Scalar too_long = kInfinity;
  for (int trial = 0; trial < kTrials && h > 0; ++trial) {
    const Scalar x = rest.turn * h;
    const Scalar noise = pair.noise * (1 + x + x * x);  // n + u k + q m is longer than n
    const Scalar c1 = gap_at(h / 2, 0.0) - noise;
    const Scalar c2 = gap_at(h, h * h / 2) - noise - rest.jerk * (h * h * h / 6) -
                      rest.acceleration * (h * h / 2);
    const Scalar root = first_root(step.gap, c1, c2, h);
    if (root >= h) {
      step.time = std::max(step.time, h);
      if (h >= pair.horizon) break;
    } else {
      // literal: a step within 5% of the last one is not worth another trial.
      const bool is_converged = root <= 1.05 * step.time && too_long <= kMuchTooLong * step.time;
      step.time = std::max(step.time, root);
      too_long = h;
      if (is_converged) break;
    }
    h = std::min(pair.horizon, 2 * step.time);
    // A bound over a longer time is not tighter.
    if (h >= too_long) break;
    if (too_long < kInfinity && too_long > kMuchTooLong * step.time) {
      h = std::sqrt(step.time * too_long);
    }
  }
  return step;
}

/// The same with the gap from `gap_at`, trying the whole horizon first.
template <typename Gap>
SafeStep coupled_step(const PairInstant& pair, const MotionRemainder& rest, const Gap& gap_at) {
  const Scalar gap = gap_at(0.0, 0.0) - pair.noise;
  return coupled_step(pair, gap, pair.horizon, rest, gap_at);
}

/// The separation along n of two pieces as a function of the turning parameters, minus floor.
template <typename PieceA, typename PieceB>
struct TurningGap {
  const PieceA& a;
  const PieceB& b;
  TurningDirection turn_a;
  TurningDirection turn_b;
  // For n(s) . (p_B(s) - p_A(s)): its value, its derivatives, and bounds on the remainder.
  Scalar origins;
  Scalar opening;
  Scalar bending;
  Scalar jerk;

  TurningGap(const PairInstant& pair, const PieceA& piece_a, const PieceB& piece_b,
             const TurningNormal& normal, Scalar floor)
      : a(piece_a), b(piece_b), turn_a(pair.a, normal), turn_b(pair.b, normal) {
    const Vector3 p_AB_W = pair.b.p_WB - pair.a.p_WB;
    const Vector3 v_AB_W = pair.b.v_WB - pair.a.v_WB;
    const Vector3 rate_W = normal.turn_W.cross(normal.n_W);
    const Scalar turn = normal.turn_W.norm();
    origins = normal.n_W.dot(p_AB_W) - floor;
    opening = normal.n_W.dot(v_AB_W) + rate_W.dot(p_AB_W);
    bending = normal.turn_W.cross(rate_W).dot(p_AB_W) + 2 * rate_W.dot(v_AB_W);
    jerk = turn * turn * (turn * p_AB_W.norm() + 3 * v_AB_W.norm());
  }

  Scalar operator()(Scalar u, Scalar q) const {
    return origins + u * opening + q * bending - largest_along(b, -turn_b.at(u, q)) -
           largest_along(a, turn_a.at(u, q));
  }
};

/// The best of all bounds. The gap at the instant is given minus floor and noise.
template <typename PieceA, typename PieceB>
SafeStep best_step(const PairInstant& pair, const TurningGap<PieceA, PieceB>& gap_at,
                   Scalar radius_a, Scalar radius_b, Scalar gap, Scalar first, Scalar floor) {
  const TurningDirection& turn_a = gap_at.turn_a;
  const TurningDirection& turn_b = gap_at.turn_b;
  MotionRemainder rest;
  rest.jerk = turn_a.third * radius_a + turn_b.third * radius_b + gap_at.jerk;
  rest.acceleration = pair.linear_acceleration + pair.angular_acceleration_a * radius_a +
                      pair.angular_acceleration_b * radius_b;
  rest.turn = std::max(turn_a.rate, turn_b.rate);
  SafeStep step = coupled_step(pair, gap, first, rest, gap_at);
  if (step.gap > 0 && step.time < pair.remaining) {
    const Scalar speed =
        pair.linear_speed + pair.angular_speed_a * radius_a + pair.angular_speed_b * radius_b;
    const Scalar by_speed = speed >= 0 ? step.gap / speed : 0;  // NaN (infinite bound): no step
    const Scalar by_balls = safe_time_of_balls(pair, radius_a, radius_b, floor);
    step.time = std::max(step.time, std::max(by_speed, by_balls));
  }
  if (step.gap > 0 && step.time >= pair.remaining) step.time = kInfinity;
  return step;
}

template <typename PieceA, typename PieceB>
SafeStep safe_step(const PairInstant& pair, const PieceA& a, Scalar radius_a, const PieceB& b,
                   Scalar radius_b, const TurningNormal& normal, Scalar floor) {
  const TurningGap<PieceA, PieceB> gap_at(pair, a, b, normal, floor);
  const Scalar gap = gap_at(0.0, 0.0) - pair.noise;
  return best_step(pair, gap_at, radius_a, radius_b, gap, pair.horizon, floor);
}

template <typename PieceA, typename PieceB>
SafeStep safe_step(const PairInstant& pair, const PieceA& a, Scalar radius_a, const PieceB& b,
                   Scalar radius_b, const Slab& slab, Scalar floor) {
  const TurningGap<PieceA, PieceB> gap_at(pair, a, b, slab.normal, floor);
  const Scalar gap = slab.gap - floor - pair.noise;
  // literal: allows for a falling closing speed; a step that is too short is doubled.
  const Scalar guess = 1.25 * gap / slab.closing;
  const bool is_guess = slab.closing > 0 && guess < pair.horizon;
  return best_step(pair, gap_at, radius_a, radius_b, gap, is_guess ? guess : pair.horizon, floor);
}

}  // namespace dyop::toi_internal
