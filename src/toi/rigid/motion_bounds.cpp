// SPDX-License-Identifier: BSD-3-Clause
#include "toi/rigid/motion_bounds.h"

#include <algorithm>
#include <cmath>

#include "geometry/shape_tree.h"
#include "motion/curve/chart_curve.h"

namespace dyop::toi_internal {
namespace {

TwistBound join(const TwistBound& x, const TwistBound& y) {
  return {std::max(x.linear_speed, y.linear_speed), std::max(x.angular_speed, y.angular_speed),
          std::max(x.linear_acceleration, y.linear_acceleration),
          std::max(x.angular_acceleration, y.angular_acceleration)};
}

}  // namespace

Scalar largest_coordinate(const Motion& motion, const TwistBound& bound, Scalar radius,
                          const TimeInterval& interval) {
  const PoseScale scale = motion.pose_scale(interval);
  const Scalar latest = std::max(std::abs(interval.begin), std::abs(interval.end));
  const Scalar size = scale.length + times(scale.angle, radius) +
                      times(bound.linear_speed, interval.length()) +
                      times(bound.linear_speed + times(bound.angular_speed, radius), latest);
  return size >= 0 ? size : kInfinity;  // NaN
}

// A body is never farther from where it begins than its speed allows.
Scalar largest_distance(Scalar origins, const TwistBound& a, const TwistBound& b,
                        const TimeInterval& interval) {
  const Scalar moved = times(a.linear_speed + b.linear_speed, interval.length());
  // literal: more than the rounding of the bound
  return (origins + moved) * (1 + 1e-9);
}

Scalar extent_in(const Shape& shape, const Motion& X_WS, const Shape& other, const Motion& X_WO,
                 const TimeInterval& interval) {
  if (!as_half_space(shape)) return kInfinity;
  const Vector3 begin =
      X_WO.pose(interval.begin).translation() - X_WS.pose(interval.begin).translation();
  const Scalar apart = largest_distance(begin.norm(), X_WS.twist_bound(interval),
                                        X_WO.twist_bound(interval), interval);
  return geometry_internal::extent_beside(shape, other, apart);
}

Scalar radius_in(const Shape& shape, const Motion& X_WS, const Shape& other, const Motion& X_WO,
                 const TimeInterval& interval) {
  const HalfSpace* half_space = as_half_space(shape);
  if (!half_space) return shape.bounding_radius();
  return half_space->within(extent_in(shape, X_WS, other, X_WO, interval)).bounding_radius();
}

MotionBounds::MotionBounds(const Motion& motion, const TimeInterval& interval, BoundLookups lookups)
    : motion_(motion), interval_(interval), whole_(motion.twist_bound(interval)) {
  is_uniform_ = (whole_.linear_acceleration == 0 && whole_.angular_acceleration == 0) ||
                interval.length() <= 0;
  if (is_uniform_ || lookups == BoundLookups::Few) return;
  pieces_.emplace();
  for (int i = 0; i < kPieces; ++i) {
    // Neighbours overlap only by rounding, and piece_at() is at most one piece off.
    const Scalar begin = interval.begin + interval.length() * i / kPieces;
    const Scalar end = interval.begin + interval.length() * (i + 1) / kPieces;
    (*pieces_)[static_cast<std::size_t>(i)] =
        motion.twist_bound({std::max(begin, interval.begin), std::min(end, interval.end)});
  }
}

int MotionBounds::piece_at(Scalar t) const {
  const Scalar x = (t - interval_.begin) / interval_.length() * kPieces;
  return static_cast<int>(std::clamp(std::floor(x), 0.0, static_cast<Scalar>(kPieces - 1)));
}

TwistBound MotionBounds::over(Scalar begin, Scalar end) const {
  if (is_uniform_) return whole_;
  if (!pieces_) return motion_.twist_bound({begin, end});
  const int first = piece_at(begin);
  // Rounding may put a time at a border into either neighbour.
  const int last = std::min(piece_at(end) + 1, kPieces - 1);
  TwistBound bound = (*pieces_)[static_cast<std::size_t>(std::max(first - 1, 0))];
  for (int i = first; i <= last; ++i) bound = join(bound, (*pieces_)[static_cast<std::size_t>(i)]);
  if (bound.linear_acceleration < kInfinity && bound.angular_acceleration < kInfinity) return bound;
  // The twist may jump in one of the pieces, but not between begin and end.
  return motion_.twist_bound({begin, end});
}

}  // namespace dyop::toi_internal
