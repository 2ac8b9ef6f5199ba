// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>

#include "dyop/geometry/shape.h"
#include "dyop/motion/motion.h"

namespace dyop::toi_internal {

/// Size of the numbers from which gaps of a moving body are computed: its coordinates, and how far
/// a point moves in the rounding of a time. `bound` holds over the interval, in which the body's
/// points stay within `radius` of its origin.
///
/// A gap errs by at most kStepNoise times the sum of this for both bodies, |w| (below) times:
/// - poses, relative to P + Q r (Motion::pose_scale; tests/motion/pose_scale_test.cpp): 64 u;
/// - a posed point 8 u, the relative pose X_AB 24 u of the coordinates' size, a rotation orthonormal
///   to 12 u (measured; tested to 24 u) as much again: below 64 u (kPoseNoise);
/// - the gap of two boxes along n + u k + q m, a sum of eight products, in |w| times the sizes: k
///   and m 4 u, dot products 3 u each and their sum 3 u, products 1 u, the sum 7 u: below 18 u. Less
///   for triangles and support points. Along a direction that turns by itself k and m carry 8 u:
///   below 22 u;
/// - terms of the origins along it, of |p| (1 + x + x²/2) + h |v| (1 + x), where the size has |p|
///   and speed times length: below 17 u.
/// Here |w| <= 1 + x + x²/2 with x = |w| h, or (|w| + |z|) h. Sizes are |centre| + sqrt(3) |half
/// extents| of a box, at most 4 r, since its centre and each half extent, being of points within r,
/// are at most r. Together (56 + 22) 4 u = 312 u. Besides: axes of stored boxes have unit length to
/// 2^-22 only, which does not affect a support value; radii are rounded up by 2^-20; a direction has
/// unit length to 8 u, and the floor is raised by 64 u of itself instead of dividing by the length;
/// t + s is rounded to u max|t|, and points move by their speed times that.
DYOP_EXPORT Scalar largest_coordinate(const Motion& motion, const TwistBound& bound, Scalar radius,
                                      const TimeInterval& interval);

/// A bound on the distance of two bodies' origins over an interval at whose begin it is `origins`.
Scalar largest_distance(Scalar origins, const TwistBound& a, const TwistBound& b,
                        const TimeInterval& interval);

/// Within which distance of its frame's origin a half-space matters in a query against another
/// shape over an interval: see extent_beside(). Infinite for other shapes.
Scalar extent_in(const Shape& shape, const Motion& X_WS, const Shape& other, const Motion& X_WO,
                 const TimeInterval& interval);

/// Shape::bounding_radius(), of a half-space that of the part that matters.
Scalar radius_in(const Shape& shape, const Motion& X_WS, const Shape& other, const Motion& X_WO,
                 const TimeInterval& interval);

/// How often MotionBounds::over() will be called: pieces pay off after about 16 calls.
enum class BoundLookups { Few, Many };

/// Twist bounds of one motion over parts of a fixed interval, precomputed over equal pieces so that
/// the many short look-ups of a mesh query cost a few comparisons each.
class MotionBounds {
 public:
  MotionBounds(const Motion& motion, const TimeInterval& interval,
               BoundLookups lookups = BoundLookups::Many);

  /// Bounds over [begin, end], a part of the interval in which the twist does not jump:
  /// end <= motion.smooth_until(begin).
  TwistBound over(Scalar begin, Scalar end) const;

  /// Bounds over the whole interval.
  const TwistBound& whole() const { return whole_; }

 private:
  static constexpr int kPieces = 16;

  int piece_at(Scalar t) const;

  const Motion& motion_;
  TimeInterval interval_;
  TwistBound whole_;
  bool is_uniform_ = false;  // no acceleration anywhere: the whole bound fits every part
  std::optional<std::array<TwistBound, kPieces>> pieces_;
};

}  // namespace dyop::toi_internal
