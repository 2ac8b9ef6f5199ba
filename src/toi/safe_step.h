#pragma once

#include <cmath>

#include "dyop/core/types.h"
#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/mesh_hierarchy.h"
#include "dyop/geometry/triangle.h"

namespace dyop::internal {

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

/// The world's view of one fixed direction n as the bodies turn: n . R(s) x = n(s) . x with
/// n(s) = n + s k + s^2/2 m + remainder, k = n x w, m = k x w (docs/algorithms/time_of_impact.md).
struct TurningDirection {
  Vector3 n_B;  ///< n, k and m in the body's frame
  Vector3 k_B;
  Vector3 m_B;
  Scalar k_norm = 0;
  Scalar w_sq = 0;

  TurningDirection(const BodyInstant& body, const Vector3& n_W) {
    const Vector3 k_W = n_W.cross(body.w_WB);
    const Vector3 m_W = k_W.cross(body.w_WB);
    n_B = body.R_WB.transpose() * n_W;
    k_B = body.R_WB.transpose() * k_W;
    m_B = body.R_WB.transpose() * m_W;
    k_norm = k_W.norm();
    w_sq = body.w_WB.squaredNorm();
  }
  Vector3 at(Scalar u, Scalar q) const { return n_B + u * k_B + q * m_B; }
};

/// How long two pieces of two moving bodies are proven to stay more than `floor` apart.
struct SafeStep {
  Scalar gap = 0;   ///< slab gap along n at the instant, minus floor, rounded down
  Scalar time = 0;  ///< safe for this long, rounded down; infinite: to the end of the query
};

/// A direction and what is known of it at the instant.
struct Slab {
  Vector3 n_W = Vector3::UnitX();  ///< unit, from A to B
  Scalar gap = 0;                  ///< slab gap along n_W, rounded down
  Scalar closing = 0;  ///< guess of the rate at which it shrinks: says which times are tried first
};

/// Bounds that need no direction: two balls about the body origins, and the largest speeds.
Scalar safe_time_of_balls(const PairInstant& pair, Scalar radius_a, Scalar radius_b, Scalar floor);

/// Finds a safe step along the unit direction n_W (from A to B), by the coupled second-order bound
/// and the direction-free ones.
///
/// @param radius_a, radius_b  Largest distance of a point of each piece from its body's origin.
template <typename PieceA, typename PieceB>
SafeStep safe_step(const PairInstant& pair, const PieceA& a, Scalar radius_a, const PieceB& b,
                   Scalar radius_b, const Vector3& n_W, Scalar floor);

/// The same along a direction whose gap is known.
template <typename PieceA, typename PieceB>
SafeStep safe_step(const PairInstant& pair, const PieceA& a, Scalar radius_a, const PieceB& b,
                   Scalar radius_b, const Slab& slab, Scalar floor);

// --- implementation
// -------------------------------------------------------------------------------

/// Everything of safe_step() that does not depend on the kind of piece: given the gap as a concave
/// function G(u, q) of the turning parameters.
///
/// @param first Length of the step that is tried first.
template <typename Gap>
SafeStep coupled_step(const PairInstant& pair, Scalar gap, Scalar first, Scalar jerk,
                      Scalar acceleration, Scalar turn, const Gap& gap_at) {
  constexpr int kTrials = 4;
  SafeStep step;
  step.gap = gap < kInfinity ? gap : 0;  // an overflow proves nothing
  if (!(step.gap > 0)) return step;
  Scalar h = first;
  for (int trial = 0; trial < kTrials && h > 0; ++trial) {
    const Scalar x = turn * h;
    const Scalar noise = pair.noise * (1 + x + x * x);  // the turned direction is longer than n
    const Scalar c1 = gap_at(h / 2, 0.0) - noise;
    const Scalar c2 =
        gap_at(h, h * h / 2) - noise - jerk * (h * h * h / 6) - acceleration * (h * h / 2);
    const Scalar root = first_root(step.gap, c1, c2, h);
    if (root >= h) {
      step.time = std::max(step.time, h);
      if (h >= pair.horizon) break;
      h = std::min(pair.horizon, 2 * h);
      continue;
    }
    // literal: a step within 5% of the last is not worth another trial.
    const bool is_settled = root <= 1.05 * step.time;
    step.time = std::max(step.time, root);
    // A bound over a longer time is no tighter.
    if (is_settled || 2 * root >= h) break;
    h = 2 * root;
  }
  return step;
}

/// The same with the gap from `gap_at`, and the whole horizon tried first.
template <typename Gap>
SafeStep coupled_step(const PairInstant& pair, Scalar jerk, Scalar acceleration, Scalar turn,
                      const Gap& gap_at) {
  const Scalar gap = gap_at(0.0, 0.0) - pair.noise;
  return coupled_step(pair, gap, pair.horizon, jerk, acceleration, turn, gap_at);
}

/// The separation along n of two pieces as a function of the turning parameters, minus floor.
template <typename PieceA, typename PieceB>
struct TurningGap {
  const PieceA& a;
  const PieceB& b;
  TurningDirection turn_a;
  TurningDirection turn_b;
  Scalar origins;
  Scalar opening;

  TurningGap(const PairInstant& pair, const PieceA& piece_a, const PieceB& piece_b,
             const Vector3& n_W, Scalar floor)
      : a(piece_a),
        b(piece_b),
        turn_a(pair.a, n_W),
        turn_b(pair.b, n_W),
        origins(n_W.dot(pair.b.p_WB - pair.a.p_WB) - floor),
        opening(n_W.dot(pair.b.v_WB - pair.a.v_WB)) {}

  Scalar operator()(Scalar u, Scalar q) const {
    return origins + u * opening - largest_along(b, -turn_b.at(u, q)) -
           largest_along(a, turn_a.at(u, q));
  }
};

/// The best of all bounds. The gap at the instant is given with the floor and noise taken off.
template <typename PieceA, typename PieceB>
SafeStep best_step(const PairInstant& pair, const TurningGap<PieceA, PieceB>& gap_at,
                   Scalar radius_a, Scalar radius_b, Scalar gap, Scalar first, Scalar floor) {
  const TurningDirection& turn_a = gap_at.turn_a;
  const TurningDirection& turn_b = gap_at.turn_b;
  const Scalar jerk =
      turn_a.w_sq * turn_a.k_norm * radius_a + turn_b.w_sq * turn_b.k_norm * radius_b;
  const Scalar acceleration = pair.linear_acceleration + pair.angular_acceleration_a * radius_a +
                              pair.angular_acceleration_b * radius_b;
  const Scalar turn = std::sqrt(std::max(turn_a.w_sq, turn_b.w_sq));
  SafeStep step = coupled_step(pair, gap, first, jerk, acceleration, turn, gap_at);
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
                   Scalar radius_b, const Vector3& n_W, Scalar floor) {
  const TurningGap<PieceA, PieceB> gap_at(pair, a, b, n_W, floor);
  const Scalar gap = gap_at(0.0, 0.0) - pair.noise;
  return best_step(pair, gap_at, radius_a, radius_b, gap, pair.horizon, floor);
}

template <typename PieceA, typename PieceB>
SafeStep safe_step(const PairInstant& pair, const PieceA& a, Scalar radius_a, const PieceB& b,
                   Scalar radius_b, const Slab& slab, Scalar floor) {
  const TurningGap<PieceA, PieceB> gap_at(pair, a, b, slab.n_W, floor);
  const Scalar gap = slab.gap - floor - pair.noise;
  // literal: room for a closing speed that falls; a step that is too short is doubled.
  const Scalar guess = 1.25 * gap / slab.closing;
  const bool is_guess = slab.closing > 0 && guess < pair.horizon;
  return best_step(pair, gap_at, radius_a, radius_b, gap, is_guess ? guess : pair.horizon, floor);
}

}  // namespace dyop::internal
