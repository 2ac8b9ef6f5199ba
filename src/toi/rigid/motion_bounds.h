// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "dyop/motion/motion.h"

namespace dyop::internal {

/// Size of the numbers that gaps of a moving body are computed from: its coordinates, and how far a
/// point moves in the rounding of a time. `bound` is that over the interval, which the body's
/// points within `radius` of its origin stay in.
Scalar largest_coordinate(const Motion& motion, const TwistBound& bound, Scalar radius,
                          const TimeInterval& interval);

/// How often MotionBounds::over() will be called: pieces pay for themselves after some 16 calls.
enum class BoundLookups { Few, Many };

/// Twist bounds of one motion over parts of a fixed interval, precomputed over equal pieces so that
/// the many small look-ups of a query of meshes cost a few comparisons each.
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
  bool is_uniform_ = false;  // no acceleration anywhere: the whole bound serves every part
  bool has_pieces_ = false;
  std::array<TwistBound, kPieces> pieces_;
};

}  // namespace dyop::internal
