// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "dyop/core/time_interval.h"
#include "dyop/geometry/shape.h"
#include "dyop/motion/motion.h"

namespace dyop::toi_internal {

/// Equal parts of an interval. Neighbours share their ends.
struct TimeParts {
  TimeInterval interval;
  int count = 1;

  TimeInterval part(int i) const { return {time(i), time(i + 1)}; }
  Scalar time(int i) const;
};

/// A box in world that contains the shape at all times of `part`, rounding included. Infinite where
/// the bounds of the motion are.
AlignedBox swept_box(const Shape& shape, const Motion& motion, const TimeInterval& part);

/// The box of a shape at rest, rounding included.
AlignedBox placed_box(const Shape& shape, const RigidPose& X_WS);

/// Lower bound on the distance of two boxes, rounded down; zero if they overlap.
Scalar box_gap(const AlignedBox& a, const AlignedBox& b);

/// The boxes of a moving shape, part by part.
class SweptBoxes {
 public:
  SweptBoxes(const Shape& shape, const Motion& motion, const TimeParts& parts);

  const AlignedBox& whole() const { return whole_; }
  const AlignedBox& part(int i) const { return boxes_[static_cast<std::size_t>(i)]; }
  int count() const { return static_cast<int>(boxes_.size()); }

  /// The first part, from `first` on, in which the shape may come within `reach` of a box; nothing
  /// if there is none.
  std::optional<int> first_near(const AlignedBox& box, Scalar reach, int first) const;
  int last_near(const AlignedBox& box, Scalar reach, int first) const;
  /// How near it may come to a box, rounded down.
  Scalar least_gap(const AlignedBox& box) const;

 private:
  std::vector<AlignedBox> boxes_;
  AlignedBox whole_;
};

}  // namespace dyop::toi_internal
