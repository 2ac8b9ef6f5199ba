// SPDX-License-Identifier: BSD-3-Clause
#include "toi/rigid/safe_step.h"

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"

namespace dyop::toi_internal {

namespace {

// Squared sine between two edges below which their normal would turn much faster than they do.
// Speed only.
constexpr Scalar kParallelSquare = 0.04;

}  // namespace

Vector3 turn_with_edges(const Vector3& n_W, std::span<const Vector3> edges_a, const Vector3& w_WA,
                        std::span<const Vector3> edges_b, const Vector3& w_WB) {
  // The rate of the normal, perpendicular to it, from what its products with the edges must be.
  const Vector3 with_a_W = w_WA.cross(n_W);
  const Vector3 with_b_W = w_WB.cross(n_W);
  Vector3 rate_W = Vector3::Zero();
  if (edges_a.size() == 2) {
    rate_W = with_a_W;
  } else if (edges_b.size() == 2) {
    rate_W = with_b_W;
  } else if (!edges_a.empty() || !edges_b.empty()) {
    const bool is_of_a = !edges_a.empty();
    const Vector3& e = is_of_a ? edges_a[0] : edges_b[0];
    rate_W = (e.dot(is_of_a ? with_a_W : with_b_W) / e.squaredNorm()) * e;
    if (!edges_a.empty() && !edges_b.empty()) {
      // The rest for B's edge, along its component perpendicular to A's.
      const Vector3& f = edges_b[0];
      const Vector3 f_square = f - (f.dot(e) / e.squaredNorm()) * e;
      if (f_square.squaredNorm() > kParallelSquare * f.squaredNorm()) {
        rate_W += (f.dot(with_b_W - rate_W) / f_square.squaredNorm()) * f_square;
      }
    }
  }
  const Vector3 turn_W = n_W.cross(rate_W);
  return turn_W.allFinite() ? turn_W : Vector3::Zero();
}

Scalar first_root(Scalar c0, Scalar c1, Scalar c2, Scalar h) {
  // c0 (1-x)^2 + 2 c1 x (1-x) + c2 x^2 = c0 - 2 b x + a x^2 with b = c0 - c1, a = c0 - 2 c1 + c2.
  const Scalar b = c0 - c1;
  const Scalar a = b - (c1 - c2);
  const Scalar discriminant = b * b - a * c0;
  // If a coefficient is not finite, neither is this; NaN and overflow prove nothing.
  if (!std::isfinite(discriminant)) return 0;
  // Positive coefficients: positive on all of [0, h].
  if (c1 >= 0 && c2 >= 0) return kInfinity;
  if (discriminant < 0) {
    // a > 0 and no root: positive everywhere; within rounding of a double root, step to it.
    const Scalar at_least = -discriminant;
    // literal: relative noise of b * b - a * c0, a few roundings of each product.
    if (at_least > 16 * kUnitRoundoff * (b * b + std::abs(a) * c0)) return kInfinity;
  }
  // The first positive root, in the form without cancellation: c0 / (b + sqrt(b^2 - a c0)) if the
  // value falls at first (b > 0), (b - sqrt(b^2 - a c0)) / a if it rises first (a < 0).
  const Scalar root = std::sqrt(std::max(discriminant, 0.0));
  if (b <= 0 && !(a < 0)) return kInfinity;
  const Scalar x = b > 0 ? c0 / (b + root) : (b - root) / a;
  if (x > 1) return kInfinity;
  return x * h * (1 - 32 * kUnitRoundoff);
}

// The first root of |p + s v|^2 - reach^2, with Bernstein coefficients |p|^2 - reach^2, that plus
// h p.v, and |p + h v|^2 - reach^2.
Scalar safe_time_of_points(const Vector3& p, const Vector3& v, Scalar reach, Scalar h) {
  const Scalar closing = h * p.dot(v);
  const Scalar path = h * v.norm();
  const Scalar largest = p.norm() + path;
  // literal: the roundings of all terms and of the root, each at most a few u of the square.
  const Scalar c0 = p.squaredNorm() - reach * reach - 64 * kUnitRoundoff * largest * largest;
  if (!(c0 > 0)) return 0;
  return std::min(h, first_root(c0, c0 + closing, c0 + 2 * closing + path * path, h));
}

Scalar safe_time_of_balls(const PairInstant& pair, Scalar radius_a, Scalar radius_b, Scalar floor) {
  const Vector3 p_AB_W = pair.b.p_WB - pair.a.p_WB;
  const Vector3 v_AB_W = pair.b.v_WB - pair.a.v_WB;
  const Scalar origins = p_AB_W.norm();
  const Scalar reach = radius_a + radius_b + floor + pair.noise;
  const Scalar gap = origins - reach;
  if (!(gap > 0 && gap < kInfinity)) return 0;  // overflow proves nothing
  const Scalar h = pair.horizon;
  const Scalar acceleration = pair.linear_acceleration;
  if (acceleration == 0) return safe_time_of_points(p_AB_W, v_AB_W, reach, h);
  // On [0, h]: gap + opening s - acceleration s^2 / 2, with Bernstein coefficients
  // gap, gap + opening h / 2, gap + opening h - acceleration h^2 / 2.
  const Scalar opening = p_AB_W.dot(v_AB_W) / origins;
  const Scalar root =
      first_root(gap, gap + opening * h / 2, gap + opening * h - acceleration * (h * h / 2), h);
  const Scalar along = std::min(root, h);
  // What passes at a distance is nearer than along its first direction for a while only: up to
  // twice that time, with all that acceleration can do by then.
  const Scalar longer = std::min(h, 2 * along);
  return std::max(along, safe_time_of_points(p_AB_W, v_AB_W,
                                             reach + acceleration * (longer * longer / 2), longer));
}

SafeStep safe_step_of_balls(const PairInstant& pair, Scalar radius_a, Scalar radius_b,
                            Scalar floor) {
  SafeStep step;
  step.gap = (pair.b.p_WB - pair.a.p_WB).norm() - radius_a - radius_b - floor - pair.noise;
  if (!(step.gap > 0 && step.gap < kInfinity)) return {};
  // NaN (infinite bound): no step
  const Scalar by_speed = pair.linear_speed >= 0 ? step.gap / pair.linear_speed : 0;
  step.time = std::max(safe_time_of_balls(pair, radius_a, radius_b, floor), by_speed);
  if (step.time >= pair.remaining) step.time = kInfinity;
  return step;
}

}  // namespace dyop::toi_internal
