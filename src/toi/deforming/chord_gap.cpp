// SPDX-License-Identifier: BSD-3-Clause
#include "toi/deforming/chord_gap.h"

#include <algorithm>

#include "core/tolerance.h"

namespace dyop::toi_internal {
namespace {

// More than the rounding error of the few operations in a bound.
constexpr Scalar kRoundedUp = 1 + 64 * kUnitRoundoff;

Scalar largest_size(const DeformingMesh& a, const TriangleMesh& b, const Motion& X_WB,
                    const TwistBound& bound, Scalar duration) {
  return a.largest_radius() + 2 * a.largest_displacement() +
         largest_coordinate(X_WB, bound, b.bounding_radius(), {0, duration});
}

}  // namespace

ChordGap::ChordGap(const DeformingMesh& a, const DeformingSpan& span, const TriangleMesh& b,
                   const Motion& X_WB, Scalar duration)
    : a_(a), span_(span), b_(b), X_WB_begin_(X_WB.pose(0)), X_WB_end_(X_WB.pose(duration)) {
  const TwistBound bound = X_WB.twist_bound({0, duration});
  const Scalar eighth = duration * duration / 8 * kRoundedUp;
  bend_ = eighth * bound.linear_acceleration;
  bend_per_length_ =
      eighth * (bound.angular_acceleration + bound.angular_speed * bound.angular_speed);
  noise_ = kStepNoise * largest_size(a, b, X_WB, bound, duration);
}

Scalar ChordGap::bend(Scalar radius) const {
  return bend_ + bend_per_length_ * radius * kRoundedUp;
}

Scalar ChordGap::least(std::int32_t triangle_a, std::int32_t triangle_b, const Vector3& n_W) const {
  const Triangle t_B = b_.triangle(triangle_b);
  Scalar radius_sq = 0;
  for (const Vector3& p_B : t_B) radius_sq = std::max(radius_sq, p_B.squaredNorm());
  const auto gap = [&](const RigidPose& X_WB, Scalar s) {
    const Vector3 n_B = X_WB.rotation().transpose() * n_W;
    return n_W.dot(X_WB.translation()) - largest_along(t_B, -n_B) -
           largest_along(a_.triangle(triangle_a, s), n_W);
  };
  return std::min(gap(X_WB_begin_, span_.begin), gap(X_WB_end_, span_.end)) -
         bend(std::sqrt(radius_sq)) - noise_;
}

Scalar ChordGap::least_of_boxes(const StandingPair& begin, const StandingPair& end,
                                std::int32_t box_a, std::int32_t box_b, const Vector3& n_W) const {
  return std::min(begin.box_gap(box_a, box_b, n_W), end.box_gap(box_a, box_b, n_W)) -
         bend(begin.b.radius(box_b)) - noise_;
}

}  // namespace dyop::toi_internal
