// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/motion/composed_motion.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "motion/curve/bernstein.h"
#include "motion/curve/chart_curve.h"
#include "motion/curve/chord_tree.h"
#include "motion/guarded_state.h"

namespace dyop {

ComposedMotion::ComposedMotion(std::shared_ptr<const Motion> X_WM,
                               std::shared_ptr<const Motion> X_MB)
    : outer_(std::move(X_WM)), inner_(std::move(X_MB)) {
  DYOP_REQUIRE(outer_ && inner_, "composed motion needs two motions, but one is null");
  const TimeInterval common = domain();
  DYOP_REQUIRE(common.begin <= common.end,
               "the two motions of a composed motion have no time in common: one starts at ",
               common.begin, ", the other ends at ", common.end);
}

TimeInterval ComposedMotion::domain() const {
  const TimeInterval outer = outer_->domain();
  const TimeInterval inner = inner_->domain();
  return {std::max(outer.begin, inner.begin), std::min(outer.end, inner.end)};
}

RigidPose ComposedMotion::pose(Scalar t) const {
  return outer_->pose(t) * inner_->pose(t);
}

Twist ComposedMotion::twist(Scalar t) const {
  const Matrix3 R_WM = outer_->pose(t).rotation();
  const Twist outer = outer_->twist(t);
  const Twist inner = inner_->twist(t);
  const Vector3 q_W = R_WM * inner_->pose(t).translation();
  return {outer.v_WB + outer.w_WB.cross(q_W) + R_WM * inner.v_WB, outer.w_WB + R_WM * inner.w_WB};
}

TwistBound ComposedMotion::twist_bound(const TimeInterval& interval) const {
  const TwistBound outer = outer_->twist_bound(interval);
  const TwistBound inner = inner_->twist_bound(interval);
  // Every time of the interval is within half its length of the middle. Infinite intervals give
  // infinity or NaN here, and round_up turns both into infinity.
  const Scalar middle = interval.begin + interval.length() / 2;
  const RigidPose X_MB = std::isfinite(middle) ? motion_internal::guarded_pose(
                                                     *inner_, middle, "composed motion: X_MB")
                                               : inner_->pose(middle);
  const Scalar p_norm = motion_internal::norm_of(X_MB.translation());
  const Scalar pose_noise = kPoseNoise * inner_->pose_scale(interval).length;
  const Scalar arm =
      motion_internal::round_up(p_norm + inner.linear_speed * (interval.length() / 2) + pose_noise);
  using motion_internal::round_up;
  return {round_up(outer.linear_speed + outer.angular_speed * arm + inner.linear_speed),
          round_up(outer.angular_speed + inner.angular_speed),
          round_up(outer.linear_acceleration +
                   (outer.angular_acceleration + outer.angular_speed * outer.angular_speed) * arm +
                   2 * outer.angular_speed * inner.linear_speed + inner.linear_acceleration),
          round_up(outer.angular_acceleration + outer.angular_speed * inner.angular_speed +
                   inner.angular_acceleration)};
}

PoseScale ComposedMotion::pose_scale(const TimeInterval& interval) const {
  const PoseScale outer = outer_->pose_scale(interval);
  const PoseScale inner = inner_->pose_scale(interval);
  return {outer.length + motion_internal::times(outer.angle + 1, inner.length),
          outer.angle + inner.angle};
}

Scalar ComposedMotion::smooth_until(Scalar t) const {
  return std::min(outer_->smooth_until(t), inner_->smooth_until(t));
}

namespace {

// The motion itself while it is smooth, with accelerations as for no time at all.
std::optional<MotionStretch> stretch_of(const Motion& motion, Scalar t, Scalar after) {
  const Scalar end = motion.smooth_until(t);
  if (end > after) return MotionStretch{.end = end, .twist = motion.twist(t)};
  return motion.stretch(t, after);
}

// Ends it earlier. Returns the largest speeds of the motion nearby until then.
TwistBound shorten(MotionStretch& stretch, const Motion& motion, Scalar t, Scalar end) {
  stretch.end = end;
  if (motion.smooth_until(t) >= end) {
    const TwistBound bound = motion.twist_bound({t, end});
    stretch.linear_acceleration = bound.linear_acceleration;
    stretch.angular_acceleration = bound.angular_acceleration;
  }
  using motion_internal::norm_of;
  using motion_internal::times;
  return {norm_of(stretch.twist.v_WB) + times(stretch.linear_acceleration, end - t),
          norm_of(stretch.twist.w_WB) + times(stretch.angular_acceleration, end - t)};
}

}  // namespace

std::optional<MotionStretch> ComposedMotion::stretch(Scalar t, Scalar after) const {
  std::optional<MotionStretch> outer = stretch_of(*outer_, t, after);
  std::optional<MotionStretch> inner = stretch_of(*inner_, t, after);
  if (!outer || !inner) return std::nullopt;
  const Scalar end = std::min(outer->end, inner->end);
  const TwistBound speeds = shorten(*outer, *outer_, t, end);
  const TwistBound inner_speeds = shorten(*inner, *inner_, t, end);
  const Matrix3 R_WM = outer_->pose(t).rotation();
  const Vector3 p_MB = inner_->pose(t).translation();
  const Vector3 q_W = R_WM * p_MB;
  using motion_internal::norm_of;
  using motion_internal::round_up;
  using motion_internal::times;
  const Scalar arm = norm_of(p_MB) + times(inner_speeds.linear_speed, end - t);
  const Scalar turning = speeds.angular_speed;
  return MotionStretch{
      .end = end,
      .twist = {outer->twist.v_WB + outer->twist.w_WB.cross(q_W) + R_WM * inner->twist.v_WB,
                outer->twist.w_WB + R_WM * inner->twist.w_WB},
      .linear_acceleration = round_up(
          outer->linear_acceleration + (outer->angular_acceleration + turning * turning) * arm +
          2 * turning * inner_speeds.linear_speed + inner->linear_acceleration),
      .angular_acceleration =
          round_up(outer->angular_acceleration + turning * inner_speeds.angular_speed +
                   inner->angular_acceleration),
      .linear_deviation = round_up(outer->linear_deviation + outer->angular_deviation * arm +
                                   inner->linear_deviation),
      .angular_deviation =
          std::min(2.0, round_up(outer->angular_deviation + inner->angular_deviation))};
}

namespace {

// Allows for rounding of each pose (Motion::pose_scale). Returns the jump, relative to rounding.
PoseScale require_meeting(const SequenceMotion::Part& x, const SequenceMotion::Part& y,
                          std::size_t index) {
  const Scalar t = y.interval.begin;
  const RigidPose X_WB0 = x.motion->pose(t);
  const RigidPose X_WB1 = y.motion->pose(t);
  const PoseScale scale0 = x.motion->pose_scale(x.interval);
  const PoseScale scale1 = y.motion->pose_scale(y.interval);
  const Scalar jump = (X_WB1.translation() - X_WB0.translation()).norm();
  const Scalar turn = (X_WB1.rotation() - X_WB0.rotation()).norm();
  const Scalar length = scale0.length + scale1.length;
  const Scalar angle = scale0.angle + scale1.angle;
  DYOP_REQUIRE(jump <= kPoseNoise * length && turn <= kPoseNoise * angle, "parts ", index, " and ",
               index + 1, " of sequence motion do not meet at time ", t, ": the position jumps by ",
               jump, ", the rotation matrix by ", turn);
  return {jump / kPoseNoise, turn / kPoseNoise};
}

std::shared_ptr<const motion_internal::ChordTree> make_chords(
    std::span<const SequenceMotion::Part> parts, const PoseScale& scale) {
  std::vector<Scalar> times;
  std::vector<motion_internal::ChordTree::Piece> pieces;
  for (const auto& [interval, motion] : parts) {
    times.push_back(interval.begin);
    pieces.push_back(motion_internal::chord_piece(
        motion->pose(interval.begin), motion->twist(interval.begin + interval.length() / 2).w_WB,
        motion->twist_bound(interval), interval.length()));
  }
  const SequenceMotion::Part& last = parts.back();
  times.push_back(last.interval.end);
  return std::make_shared<const motion_internal::ChordTree>(
      times, pieces, last.motion->pose(last.interval.end), scale);
}

}  // namespace

SequenceMotion::SequenceMotion(std::vector<Part> parts) : parts_(std::move(parts)) {
  DYOP_REQUIRE(!parts_.empty(), "sequence motion needs at least one part");
  std::vector<motion_internal::SpeedTree::Speeds> speeds;
  speeds.reserve(parts_.size());
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const auto& [interval, motion] = parts_[i];
    DYOP_REQUIRE(motion != nullptr, "motion of part ", i, " of sequence motion is null");
    require_valid(interval, "interval of a part of sequence motion");
    DYOP_REQUIRE(interval.length() > 0, "interval of part ", i,
                 " of sequence motion must have a positive length, not [", interval.begin, ", ",
                 interval.end, "]");
    require_defined(*motion, interval, "part of sequence motion");
    const TwistBound bound = motion->twist_bound(interval);
    speeds.push_back({bound.linear_speed, bound.angular_speed});
    pose_scale_ = motion_internal::larger_of(pose_scale_, motion->pose_scale(interval));
    is_trusted_ = is_trusted_ && motion->is_trusted();
    if (i == 0) {
      jumps_.push_back({0, 0});
      continue;
    }
    DYOP_REQUIRE(interval.begin == parts_[i - 1].interval.end, "part ", i,
                 " of sequence motion must start where part ", i - 1, " ends, at ",
                 parts_[i - 1].interval.end, ", not at ", interval.begin);
    const PoseScale jump = require_meeting(parts_[i - 1], parts_[i], i - 1);
    jumps_.push_back({jumps_.back().length + jump.length, jumps_.back().angle + jump.angle});
  }
  speeds_ = std::make_shared<const motion_internal::SpeedTree>(speeds);
  if (is_trusted_ && parts_.size() >= motion_internal::ChordTree::kFewest) {
    chords_ = make_chords(parts_, pose_scale_);
  }
}

// The part valid from t on; the first one before the domain, the last one at its end.
std::size_t SequenceMotion::part_at(Scalar t) const {
  const auto next = std::upper_bound(parts_.begin() + 1, parts_.end(), t,
                                     [](Scalar x, const Part& p) { return x < p.interval.begin; });
  return static_cast<std::size_t>(next - parts_.begin()) - 1;
}

TimeInterval SequenceMotion::domain() const {
  return {parts_.front().interval.begin, parts_.back().interval.end};
}

RigidPose SequenceMotion::pose(Scalar t) const {
  return parts_[part_at(t)].motion->pose(t);
}

Twist SequenceMotion::twist(Scalar t) const {
  return parts_[part_at(t)].motion->twist(t);
}

MotionState SequenceMotion::state(Scalar t) const {
  return parts_[part_at(t)].motion->state(t);
}

TwistBound SequenceMotion::twist_bound(const TimeInterval& interval) const {
  const std::size_t first = part_at(interval.begin);
  std::size_t last = std::max(first, part_at(interval.end));
  // Two parts that meet at the very end of the interval do not meet inside it.
  if (last > first && parts_[last].interval.begin >= interval.end) --last;
  if (first == last) return parts_[first].motion->twist_bound(interval);
  const TwistBound head =
      parts_[first].motion->twist_bound({interval.begin, parts_[first].interval.end});
  const TwistBound tail =
      parts_[last].motion->twist_bound({parts_[last].interval.begin, interval.end});
  const auto [linear, angular] = speeds_->largest(first + 1, last - 1);
  return {std::max({head.linear_speed, linear, tail.linear_speed}),
          std::max({head.angular_speed, angular, tail.angular_speed}), kInfinity, kInfinity};
}

PoseScale SequenceMotion::pose_scale(const TimeInterval& interval) const {
  const PoseScale& before = jumps_[part_at(interval.begin)];
  const PoseScale& after = jumps_[part_at(interval.end)];
  return {pose_scale_.length + (after.length - before.length),
          pose_scale_.angle + (after.angle - before.angle)};
}

Scalar SequenceMotion::smooth_until(Scalar t) const {
  if (t >= parts_.back().interval.end) return kInfinity;
  const Part& part = parts_[part_at(t)];
  return std::min(part.interval.end, part.motion->smooth_until(t));
}

std::optional<MotionStretch> SequenceMotion::stretch(Scalar t, Scalar after) const {
  const std::size_t i = part_at(t);
  const Scalar end = parts_[i].interval.end;
  if (after < end) {
    if (auto stretch = parts_[i].motion->stretch(t, after)) {
      stretch->end = std::min(stretch->end, end);
      return stretch;
    }
  }
  return chords_ ? chords_->stretch(i, after) : std::nullopt;
}

}  // namespace dyop
