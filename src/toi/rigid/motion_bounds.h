// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "dyop/motion/motion.h"

namespace dyop::toi_internal {

/// Size of the numbers from which gaps of a moving body are computed: its coordinates, and how far
/// a point moves in the rounding of a time. `bound` holds over the interval, in which the body's
/// points stay within `radius` of its origin.
Scalar largest_coordinate(const Motion& motion, const TwistBound& bound, Scalar radius,
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
  bool has_pieces_ = false;
  std::array<TwistBound, kPieces> pieces_;
};

}  // namespace dyop::toi_internal
