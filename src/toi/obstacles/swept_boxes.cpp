// SPDX-License-Identifier: BSD-3-Clause
#include "toi/obstacles/swept_boxes.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/tolerance.h"
#include "toi/rigid/motion_bounds.h"

namespace dyop::toi_internal {
namespace {

// NaN, as from infinite bounds, proves nothing.
Scalar reach_of(Scalar x) {
  return x >= 0 ? x : kInfinity;
}

// A stretch over a part in which the twist jumps.
std::optional<MotionStretch> stretch_over(const Motion& motion, const TimeInterval& part) {
  const Scalar end = motion.smooth_until(part.begin);
  if (end >= part.end) return std::nullopt;
  return motion.stretch(part.begin, std::max(end, std::nextafter(part.end, -kInfinity)));
}

// How far the origin of a body may be along an axis from where it is in the middle of a stretch. The
// deviation may be to one side there and to the other later, and the twist may change during twice
// the time.
Scalar travel_in(const MotionStretch& stretch, Scalar half, int axis) {
  return reach_of(half * std::abs(stretch.twist.v_WB[axis]) +
                  2 * half * half * stretch.linear_acceleration + 2 * stretch.linear_deviation);
}

// The same for the turn of a point at a distance of one from the origin.
Scalar turning_in(const MotionStretch& stretch, Scalar half) {
  return reach_of(half * stretch.twist.w_WB.norm() +
                  2 * half * half * stretch.angular_acceleration + 2 * stretch.angular_deviation);
}

AlignedBox posed_box(const Shape& shape, const RigidPose& X_WS, const Vector3& margin) {
  const AlignedBox box = shape.bounding_box();
  const Vector3 center = X_WS * box.center();
  const Vector3 turned = X_WS.rotation().cwiseAbs() * (box.sizes() / 2);
  // A point stays in the ball about the origin.
  const Vector3 ball = Vector3::Constant(shape.bounding_radius());
  const Vector3& origin = X_WS.translation();
  const Vector3 lowest = (center - turned).cwiseMax(origin - ball) - margin;
  const Vector3 highest = (center + turned).cwiseMin(origin + ball) + margin;
  return {lowest, highest};
}

}  // namespace

Scalar TimeParts::time(int i) const {
  if (i >= count) return interval.end;
  return std::min(interval.begin + interval.length() * i / count, interval.end);
}

AlignedBox swept_box(const Shape& shape, const Motion& motion, const TimeInterval& part) {
  const Scalar radius = shape.bounding_radius();
  const TwistBound bound = motion.twist_bound(part);
  const Scalar noise = kStepNoise * largest_coordinate(motion, bound, radius, part);
  const Scalar middle = std::clamp((part.begin + part.end) / 2, part.begin, part.end);
  // literal: more than the rounding of half the length.
  const Scalar half = std::max(part.end - middle, middle - part.begin) * (1 + 0x1p-50);
  const MotionState state = motion.state(middle);
  Vector3 travel = Vector3::Constant(noise);
  if (half > 0) {
    const std::optional<MotionStretch> stretch = stretch_over(motion, part);
    Scalar turning = reach_of(half * (bound.angular_speed * radius));
    if (stretch) turning = std::min(turning, turning_in(*stretch, half) * radius);
    for (int i = 0; i < 3; ++i) {
      const Scalar by_speed = reach_of(half * bound.linear_speed);
      const Scalar by_velocity = reach_of(half * std::abs(state.twist.v_WB[i]) +
                                          half * half / 2 * bound.linear_acceleration);
      const Scalar by_stretch = stretch ? travel_in(*stretch, half, i) : kInfinity;
      travel[i] += turning + std::min({by_speed, by_velocity, by_stretch});
    }
  }
  return posed_box(shape, state.X_WB, travel);
}

AlignedBox placed_box(const Shape& shape, const RigidPose& X_WS) {
  const Scalar size = X_WS.translation().norm() + 2 * shape.bounding_radius();
  return posed_box(shape, X_WS, Vector3::Constant(kStepNoise * size));
}

Scalar box_gap(const AlignedBox& a, const AlignedBox& b) {
  const Vector3 gap = (a.min() - b.max()).cwiseMax(b.min() - a.max()).cwiseMax(0.0);
  const Scalar length = gap.norm() * (1 - 8 * kUnitRoundoff);
  return length >= 0 ? length : 0;  // NaN
}

SweptBoxes::SweptBoxes(const Shape& shape, const Motion& motion, const TimeParts& parts) {
  for (int i = 0; i < parts.count; ++i) {
    boxes_.push_back(swept_box(shape, motion, parts.part(i)));
    whole_.extend(boxes_.back());
  }
}

std::optional<int> SweptBoxes::first_near(const AlignedBox& box, Scalar reach, int first) const {
  if (box_gap(whole_, box) > reach) return std::nullopt;
  for (int i = first; i < count(); ++i) {
    if (!(box_gap(part(i), box) > reach)) return i;
  }
  return std::nullopt;
}

int SweptBoxes::last_near(const AlignedBox& box, Scalar reach, int first) const {
  for (int i = count() - 1; i > first; --i) {
    if (!(box_gap(part(i), box) > reach)) return i;
  }
  return first;
}

Scalar SweptBoxes::least_gap(const AlignedBox& box) const {
  Scalar least = kInfinity;
  for (const AlignedBox& own : boxes_) least = std::min(least, box_gap(own, box));
  return least;
}

}  // namespace dyop::toi_internal
