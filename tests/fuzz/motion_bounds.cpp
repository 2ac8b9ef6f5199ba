// SPDX-License-Identifier: BSD-3-Clause

// Every kind of motion: poses are finite rotations, and no difference quotient of poses or twists
// exceeds twist_bound().

#include <algorithm>
#include <array>
#include <cmath>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "fuzz/fuzz_motion.h"

namespace dyop::fuzz {
namespace {

constexpr std::size_t kSamples = 9;

struct Sample {
  Scalar t;
  MotionState state;
};

// An infinite bound is legal: there a velocity may overflow, and the impact engine proves nothing.
bool is_bounded(const TwistBound& bound) {
  return bound.linear_speed < kInfinity && bound.angular_speed < kInfinity;
}

void require_valid_state(const MotionState& state, const TwistBound& bound) {
  const Matrix3& R = state.X_WB.rotation();
  require(state.X_WB.translation().allFinite() && R.allFinite(), "a pose is finite");
  require((R.transpose() * R - Matrix3::Identity()).cwiseAbs().maxCoeff() < 64 * kUnitRoundoff,
          "a rotation is orthonormal to rounding");
  require(!is_bounded(bound) || (state.twist.v_WB.allFinite() && state.twist.w_WB.allFinite()),
          "a twist with finite bounds is finite");
}

void require_valid_bound(const TwistBound& bound) {
  for (const Scalar x : {bound.linear_speed, bound.angular_speed, bound.linear_acceleration,
                         bound.angular_acceleration}) {
    require(x >= 0, "a bound is not negative and not NaN");
  }
}

// How far something gets in a time; nowhere in none, however fast.
Scalar within(Scalar rate, Scalar time) {
  return time > 0 ? rate * time : 0;
}

// literal: what the contract test allows for the rounding of a twist, relative to the speeds
constexpr Scalar kTwistNoise = 1e-12;

// What is lost to underflow by speeds and times near the end of the range.
constexpr Scalar kTiny = 0x1p-1000;

void require_bounded_twist(const Twist& twist, const TwistBound& bound, const TwistBound& whole) {
  if (!is_bounded(whole)) return;
  require(twist.v_WB.stableNorm() <= bound.linear_speed + kTiny + kTwistNoise * whole.linear_speed,
          "linear_speed bounds the velocity");
  require(
      twist.w_WB.stableNorm() <= bound.angular_speed + kTiny + kTwistNoise * whole.angular_speed,
      "angular_speed bounds the angular velocity");
}

// By how much the motion from x to y may exceed the bounds for rounding alone: of poses, as
// Motion::pose_scale() states, and of twists, 1e-13 of the speeds.
void require_bounded(const Motion& motion, const Sample& x, const Sample& y,
                     const TwistBound& bound, const TwistBound& whole) {
  const Scalar step = y.t - x.t;
  const Scalar late = std::max(std::abs(x.t), std::abs(y.t));
  const PoseScale scale = motion.pose_scale({x.t, y.t});
  // A time that is computed is off by rounding as well.
  const Scalar turn_noise =
      kTiny + 2 * kPoseNoise * scale.angle + kPoseNoise * within(whole.angular_speed, late);
  const Scalar noise =
      kTiny + 2 * kPoseNoise * scale.length + kPoseNoise * within(whole.linear_speed, late);
  const Vector3 moved = y.state.X_WB.translation() - x.state.X_WB.translation();
  require(moved.stableNorm() <= within(bound.linear_speed, step) + noise,
          "linear_speed bounds displacements");
  // |R y - R x| in the Frobenius norm is sqrt(8) |sin(angle / 2)| <= sqrt(2) angle.
  const Scalar turned = (y.state.X_WB.rotation() - x.state.X_WB.rotation()).norm() / std::sqrt(2);
  require(turned <= within(bound.angular_speed, step) + turn_noise, "angular_speed bounds turns");
  if (motion.smooth_until(x.t) < y.t || !(step > 0) || !is_bounded(whole)) return;
  // A jump at y itself is not between them.
  if (motion.smooth_until(x.t) == y.t) return;
  const Scalar soon = step + 8 * kUnitRoundoff * late;
  require((y.state.twist.v_WB - x.state.twist.v_WB).stableNorm() <=
              bound.linear_acceleration * soon + kTiny + kTwistNoise * whole.linear_speed,
          "linear_acceleration bounds changes of the velocity");
  require((y.state.twist.w_WB - x.state.twist.w_WB).stableNorm() <=
              bound.angular_acceleration * soon + kTiny + kTwistNoise * whole.angular_speed,
          "angular_acceleration bounds changes of the angular velocity");
}

void check(Input& in) {
  constexpr std::array<Scalar, 4> kLimits{1, 16, 1e3, 1e6};
  const MotionLimits limits{kLimits[std::size_t(in.index(4))], kLimits[std::size_t(in.index(3))]};
  const TimeInterval span = read_interval(in, limits.length);
  const Scalar first = Scalar(in.byte()) / 255;
  const Scalar last = first + (1 - first) * Scalar(in.byte()) / 255;
  const auto motion = read_motion(in, span, limits);
  const TimeInterval part{std::clamp(span.begin + first * span.length(), span.begin, span.end),
                          std::clamp(span.begin + last * span.length(), span.begin, span.end)};
  const TwistBound whole = motion->twist_bound(span);
  const TwistBound bound = motion->twist_bound(part);
  require_valid_bound(whole);
  require_valid_bound(bound);
  std::array<Sample, kSamples> samples;
  for (std::size_t k = 0; k < kSamples; ++k) {
    const Scalar t =
        std::clamp(part.begin + part.length() * Scalar(k) / (kSamples - 1), part.begin, part.end);
    samples[k] = {t, motion->state(t)};
    require_valid_state(samples[k].state, whole);
    require(motion->smooth_until(t) > t, "smooth_until(t) is after t");
    // At the end of the part the twist may jump to one from the right.
    if (t < part.end) require_bounded_twist(samples[k].state.twist, bound, whole);
  }
  for (std::size_t k = 0; k + 1 < kSamples; ++k) {
    require_bounded(*motion, samples[k], samples[k + 1], bound, whole);
    require_bounded(*motion, samples[0], samples[k + 1], bound, whole);
  }
}

}  // namespace
}  // namespace dyop::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  dyop::fuzz::Input in(data, size);
  try {
    dyop::fuzz::check(in);
  } catch (const dyop::InvalidArgument& error) {
    dyop::fuzz::require_readable(error.what());
  }
  return 0;
}
