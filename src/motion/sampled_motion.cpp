// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/motion/sampled_motion.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <utility>

#include "core/tolerance.h"
#include "dyop/motion/interpolated_motion.h"
#include "motion/curve/bernstein.h"
#include "motion/curve/chart_curve.h"
#include "motion/curve/chord_tree.h"

namespace dyop {

SampledMotion::SampledMotion(std::vector<Sample> given) : samples_(std::move(given)) {
  const std::vector<Sample>& samples = samples_;
  DYOP_REQUIRE(samples.size() >= 2, "sampled motion needs at least 2 samples, not ",
               samples.size());
  const std::size_t count = samples.size() - 1;
  stamps_.reserve(count + 1);
  pieces_.reserve(count);
  for (std::size_t i = 0; i <= count; ++i) {
    const Scalar t = samples[i].t;
    DYOP_REQUIRE(std::isfinite(t), "time stamp ", i, " of sampled motion must be finite, not ", t);
    DYOP_REQUIRE(i == 0 || t > stamps_.back(),
                 "time stamps of sampled motion must increase, but stamp ", i, " = ", t,
                 " follows stamp ", i - 1, " = ", stamps_.back());
    stamps_.push_back(t);
  }
  std::vector<motion_internal::SpeedTree::Speeds> speeds;
  speeds.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const RigidPose& X_WB0 = samples[i].X_WB;
    const RigidPose& X_WB1 = samples[i + 1].X_WB;
    const Scalar h = stamps_[i + 1] - stamps_[i];
    const Matrix3 R_B0B1 = X_WB0.rotation().transpose() * X_WB1.rotation();
    const Twist twist{(X_WB1.translation() - X_WB0.translation()) / h,
                      X_WB0.rotation() * rotation_vector(R_B0B1) / h};
    const motion_internal::SpeedTree::Speeds speed{
        motion_internal::round_up(motion_internal::norm_of(twist.v_WB)),
        motion_internal::round_up(motion_internal::norm_of(twist.w_WB))};
    // Where squares of velocities overflow, so may anything computed from them.
    DYOP_REQUIRE(speed.linear < kInfinity && speed.angular < kInfinity, "time stamps ", i, " = ",
                 stamps_[i], " and ", i + 1, " = ", stamps_[i + 1],
                 " of sampled motion are too close: the velocity between them overflows");
    pose_scale_ = motion_internal::larger_of(
        pose_scale_, {X_WB0.translation().stableNorm() + X_WB1.translation().stableNorm(),
                      1 + h * twist.w_WB.stableNorm()});
    pieces_.push_back({SteadyTurn(X_WB0.rotation(), twist.w_WB), twist});
    speeds.push_back(speed);
  }
  speeds_ = std::make_shared<const motion_internal::SpeedTree>(speeds);
  std::vector<motion_internal::ChordTree::Piece> chords;
  chords.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    chords.push_back({samples[i].X_WB, 0, pieces_[i].twist_WB.w_WB, 0});
  }
  chords_ = std::make_shared<const motion_internal::ChordTree>(stamps_, chords, samples.back().X_WB,
                                                               pose_scale_);
}

// The piece valid from t on; the first one before the domain, the last one at its end.
std::size_t SampledMotion::piece_at(Scalar t) const {
  const auto next = std::upper_bound(stamps_.begin() + 1, stamps_.end() - 1, t);
  return static_cast<std::size_t>(next - stamps_.begin()) - 1;
}

RigidPose SampledMotion::pose(Scalar t) const {
  const std::size_t i = piece_at(t);
  const Piece& piece = pieces_[i];
  const Scalar tau = t - stamps_[i];
  return RigidPose::from_trusted(piece.R_WB.at(tau),
                                 samples_[i].X_WB.translation() + tau * piece.twist_WB.v_WB);
}

Twist SampledMotion::twist(Scalar t) const {
  return pieces_[piece_at(t)].twist_WB;
}

TwistBound SampledMotion::twist_bound(const TimeInterval& interval) const {
  const std::size_t first = piece_at(interval.begin);
  std::size_t last = std::max(first, piece_at(interval.end));
  // A stamp at the very end of the interval is not inside it.
  if (last > first && stamps_[last] >= interval.end) --last;
  const auto [linear, angular] = speeds_->largest(first, last);
  const Scalar acceleration = last == first ? 0 : kInfinity;
  return {linear, angular, acceleration, acceleration};
}

PoseScale SampledMotion::pose_scale(const TimeInterval& interval) const {
  // The turn between two samples errs by up to 8u however small it is: the speeds do not bound what
  // that adds up to over many samples.
  constexpr Scalar kTurnNoise = 8 * kUnitRoundoff;
  const auto stamps = static_cast<Scalar>(piece_at(interval.end) - piece_at(interval.begin));
  return {pose_scale_.length, pose_scale_.angle + stamps * (kTurnNoise / kPoseNoise)};
}

Scalar SampledMotion::smooth_until(Scalar t) const {
  const auto next = std::upper_bound(stamps_.begin(), stamps_.end(), t);
  return next == stamps_.end() ? kInfinity : *next;
}

std::optional<MotionStretch> SampledMotion::stretch(Scalar t, Scalar after) const {
  return chords_->stretch(piece_at(t), after);
}

namespace {

// x + s (y - x), for both halves of a twist.
Twist mix(const Twist& x, const Twist& y, Scalar s) {
  return {x.v_WB + s * (y.v_WB - x.v_WB), x.w_WB + s * (y.w_WB - x.w_WB)};
}

}  // namespace

SequenceMotion smooth_sampled_motion(const std::vector<SampledMotion::Sample>& samples) {
  const SampledMotion steady(samples);  // checks the samples
  const std::size_t last = samples.size() - 1;
  const auto length = [&](std::size_t i) { return samples[i + 1].t - samples[i].t; };
  // Between stamps i and i + 1 the parabola has the mean velocity steady.twist(samples[i].t) at the
  // middle; in between it is linear.
  const auto at_inner = [&](std::size_t i) {
    return mix(steady.twist(samples[i - 1].t), steady.twist(samples[i].t),
               length(i - 1) / (length(i - 1) + length(i)));
  };
  const auto twist_at = [&](std::size_t i) {
    if (last == 1) return steady.twist(samples[0].t);
    if (i == 0) return mix(at_inner(1), steady.twist(samples[0].t), 2);
    if (i == last) return mix(at_inner(last - 1), steady.twist(samples[last - 1].t), 2);
    return at_inner(i);
  };
  std::vector<SequenceMotion::Part> parts;
  parts.reserve(last);
  for (std::size_t i = 0; i < last; ++i) {
    const TimeInterval interval{samples[i].t, samples[i + 1].t};
    parts.push_back({interval, std::make_shared<HermiteMotion>(
                                   interval, MotionState{samples[i].X_WB, twist_at(i)},
                                   MotionState{samples[i + 1].X_WB, twist_at(i + 1)})});
  }
  return SequenceMotion(std::move(parts));
}

}  // namespace dyop
