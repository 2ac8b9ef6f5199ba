#pragma once

#include <array>

#include "dyop/motion/motion.h"

namespace dyop::internal {

/// Twist bounds of one motion over parts of a fixed interval, precomputed over equal pieces so that
/// the many small look-ups of a query cost a few comparisons each.
class MotionBounds {
 public:
  MotionBounds(const Motion& motion, const TimeInterval& interval);

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
  std::array<TwistBound, kPieces> pieces_;
};

}  // namespace dyop::internal
