// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/motion/check_motion.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <vector>

#include "dyop/core/error.h"
#include "motion/guarded_state.h"
#include "motion/motion_differences.h"

namespace dyop {
namespace {

using core_internal::compose_message;
using MaybeFault = std::optional<MotionCheck>;

constexpr int kHalvings = 60;           // of the span between two samples, to the last bits
constexpr int kStepCount = 9;           // step lengths tried from each sample
constexpr Scalar kStepRatio = 1.0 / 8;  // of each step length to the one before
constexpr Scalar kTwistNoise =
    1e-13;  // literal: rounding of a twist, fraction of the largest speed
constexpr Scalar kShortStep = 1.0 / 256;    // fraction of the sampling step that needs no bound
constexpr Scalar kTellingNoise = 1000;      // multiple of rounding that shows a twist
constexpr Scalar kNumericTwist = 1.0 / 64;  // fraction of the sampling step that differences span

template <typename... Words>
MotionCheck fault(MotionFault kind, Scalar t, Scalar found, Scalar allowed, const Words&... words) {
  return {kind, t, found, allowed, compose_message("at t = ", t, ": ", words...)};
}

// The linear or the angular half of a motion.
struct TwistHalf {
  const char* speed_word;
  const char* acceleration_word;
  const char* field;
  Vector3 Twist::*rate;
  Scalar TwistBound::*speed;
  Scalar TwistBound::*acceleration;
};
const TwistHalf kLinear{"speed",
                        "acceleration",
                        "v_WB",
                        &Twist::v_WB,
                        &TwistBound::linear_speed,
                        &TwistBound::linear_acceleration};
const TwistHalf kAngular{
    "angular speed", "angular acceleration",     "w_WB",
    &Twist::w_WB,    &TwistBound::angular_speed, &TwistBound::angular_acceleration};

class MotionProbe {
 public:
  MotionProbe(const Motion& motion, const TimeInterval& interval,
              const MotionCheckOptions& options);

  MotionCheck run();

 private:
  MaybeFault check_domain() const;
  MaybeFault check_instant(Scalar t) const;
  MaybeFault check_instant_or_refusal(Scalar t) const;
  MaybeFault check_bound(const TimeInterval& part) const;
  MaybeFault check_piece(Scalar t, Scalar next) const;
  MaybeFault check_stretches(Scalar t) const;
  MaybeFault check_stretch(const MotionStretch& stretch, Scalar t, Scalar s) const;
  MaybeFault check_between(Scalar t, Scalar next) const;
  struct Change {
    Scalar found;
    Scalar allowed;
  };
  Change change_between(bool is_linear, Scalar from, Scalar to) const;
  MaybeFault check_displacement(bool is_linear, Scalar t, Scalar next) const;
  MaybeFault check_step(Scalar t, Scalar s) const;
  MaybeFault check_speed(const TwistHalf& half, Scalar t, const TwistBound& bound) const;
  MaybeFault check_half(const TwistHalf& half, Scalar t, Scalar s, const TwistBound& bound,
                        Scalar displacement, Scalar missed, Scalar pose_noise) const;
  std::string explain(const TwistHalf& half, Scalar t) const;
  void measure_size();
  Scalar first_bad(Scalar good, Scalar bad, const auto& is_bad) const;

  const Motion& motion_;
  const TimeInterval interval_;
  const Scalar spacing_;  // average spacing of the samples
  std::vector<Scalar> times_;
  Scalar position_noise_ = 0;
  Scalar rotation_noise_ = 0;
  Twist twist_noise_;  // in the first coordinate of each half
};

MotionProbe::MotionProbe(const Motion& motion, const TimeInterval& interval,
                         const MotionCheckOptions& options)
    : motion_(motion),
      interval_(interval),
      spacing_(interval.length() / (options.sample_count - 1)) {
  std::mt19937_64 random(options.seed);
  const int last = options.sample_count - 1;
  times_.push_back(interval.begin);
  for (int i = 1; i < last; ++i) {
    const Scalar shift = static_cast<Scalar>(random() >> 11) * 0x1p-53 - 0.5;
    times_.push_back(std::clamp(interval.begin + interval.length() * (i + shift) / last,
                                interval.begin, interval.end));
  }
  times_.push_back(interval.end);
}

// Allowances for rounding. Where bounds are infinite the sampled values replace them.
void MotionProbe::measure_size() {
  Scalar position = 0;
  Twist largest;
  for (const Scalar t : times_) {
    const MotionState state = motion_.state(t);
    position = std::max(position, state.X_WB.translation().norm());
    largest.v_WB.x() = std::max(largest.v_WB.x(), state.twist.v_WB.norm());
    largest.w_WB.x() = std::max(largest.w_WB.x(), state.twist.w_WB.norm());
  }
  const Scalar latest = std::max(std::abs(interval_.begin), std::abs(interval_.end));
  const PoseScale scale = motion_.pose_scale(interval_);
  const bool is_finite = std::isfinite(scale.length) && std::isfinite(scale.angle);
  const Scalar length = is_finite ? scale.length : position + largest.v_WB.x() * latest;
  const Scalar angle = is_finite ? scale.angle : 1 + largest.w_WB.x() * latest;
  position_noise_ = 2 * kPoseNoise * length;
  rotation_noise_ = 4 * kPoseNoise * angle;
  twist_noise_.v_WB.x() = kTwistNoise * largest.v_WB.x();
  twist_noise_.w_WB.x() = kTwistNoise * largest.w_WB.x();
}

MaybeFault MotionProbe::check_domain() const {
  const TimeInterval domain = motion_.domain();
  if (domain.begin <= interval_.begin && interval_.end <= domain.end) return std::nullopt;
  const bool is_early = !(domain.begin <= interval_.begin);
  return fault(MotionFault::Domain, is_early ? interval_.begin : interval_.end,
               is_early ? interval_.begin : interval_.end, is_early ? domain.begin : domain.end,
               "the motion is defined only on [", domain.begin, ", ", domain.end,
               "], not on all of [", interval_.begin, ", ", interval_.end, "]");
}

MaybeFault MotionProbe::check_instant(Scalar t) const {
  const RigidPose X = motion_.pose(t);
  const Matrix3& R = X.rotation();
  if (!motion_internal::is_finite(X.translation()) || !R.allFinite()) {
    return fault(MotionFault::PoseNotFinite, t, std::nan(""), kInfinity,
                 "the pose is not finite: position (", X.translation().transpose(), "), rotation (",
                 R, ")");
  }
  if (!motion_internal::is_rotation(R)) {
    const Scalar error = (R.transpose() * R - Matrix3::Identity()).cwiseAbs().maxCoeff();
    return fault(MotionFault::PoseNotRotation, t, motion_internal::rotation_error(R),
                 kEngineRotationNoise, "the pose is not a rotation: R^T R is off by ", error,
                 ", the determinant is ", R.determinant());
  }
  const Twist twist = motion_.twist(t);
  if (!motion_internal::is_finite(twist.v_WB) || !motion_internal::is_finite(twist.w_WB)) {
    return fault(MotionFault::TwistNotFinite, t, std::nan(""), kInfinity,
                 "the twist is not finite: v_WB = (", twist.v_WB.transpose(), "), w_WB = (",
                 twist.w_WB.transpose(), ")");
  }
  const MotionState state = motion_.state(t);
  if (state.X_WB.rotation() != R || state.X_WB.translation() != X.translation() ||
      state.twist.v_WB != twist.v_WB || state.twist.w_WB != twist.w_WB) {
    return fault(MotionFault::StateDiffers, t, 0, 0, "state() differs from pose() and twist()");
  }
  return std::nullopt;
}

MaybeFault MotionProbe::check_instant_or_refusal(Scalar t) const {
  try {
    return check_instant(t);
  } catch (const Error& error) {
    return fault(MotionFault::Refused, t, 0, 0, "pose, twist or state throws: ", error.what());
  }
}

MaybeFault MotionProbe::check_bound(const TimeInterval& part) const {
  const TwistBound bound = motion_.twist_bound(part);
  for (const TwistHalf* half : {&kLinear, &kAngular}) {
    for (const auto& [value, word] :
         {std::pair{bound.*half->speed, half->speed_word},
          std::pair{bound.*half->acceleration, half->acceleration_word}}) {
      if (value >= 0) continue;
      return fault(MotionFault::BoundNotValid, part.begin, value, kInfinity, "twist_bound on [",
                   part.begin, ", ", part.end, "] has the ", word, " ", value);
    }
  }
  return std::nullopt;
}

// Bisects between good and bad, to the last bits.
Scalar MotionProbe::first_bad(Scalar good, Scalar bad, const auto& is_bad) const {
  for (int i = 0; i < kHalvings; ++i) {
    const Scalar middle = good + (bad - good) / 2;
    if (!(middle > good && middle < bad)) break;
    (is_bad(middle) ? bad : good) = middle;
  }
  return bad;
}

MaybeFault MotionProbe::check_piece(Scalar t, Scalar next) const {
  const Scalar end = motion_.smooth_until(t);
  if (!(end > t)) {
    return fault(MotionFault::SmoothUntil, t, end, t, "smooth_until() must be later, not ", end);
  }
  if (next >= end) return std::nullopt;
  const Scalar later = motion_.smooth_until(next);
  const Scalar rounding = std::isfinite(end) ? 8 * kUnitRoundoff * std::abs(end) : 0;
  if (later >= end - rounding) return std::nullopt;
  return fault(MotionFault::SmoothUntil, next, later, end, "smooth_until() is ", later,
               ", but at t = ", t, " it was ", end, ": no jump of the twist before that");
}

// How much a half of the pose changes from one time to another, and what its bound allows.
MotionProbe::Change MotionProbe::change_between(bool is_linear, Scalar from, Scalar to) const {
  const TwistBound bound = motion_.twist_bound({from, to});
  const RigidPose X = motion_.pose(from);
  const RigidPose Y = motion_.pose(to);
  if (is_linear) {
    return {(Y.translation() - X.translation()).norm(),
            bound.linear_speed * (to - from) + position_noise_};
  }
  // Two unit vectors rotated by an angle separate by no more than the angle.
  const Matrix3 turned = Y.rotation() - X.rotation();
  return {turned.colwise().norm().maxCoeff(), bound.angular_speed * (to - from) + rotation_noise_};
}

// Holds for any pieces: a body does not move faster than its bound.
MaybeFault MotionProbe::check_displacement(bool is_linear, Scalar t, Scalar next) const {
  const Change whole = change_between(is_linear, t, next);
  if (!(whole.found > whole.allowed)) return std::nullopt;
  Scalar from = t;
  Scalar to = next;
  for (int i = 0; i < kHalvings; ++i) {
    const Scalar middle = from + (to - from) / 2;
    if (!(middle > from && middle < to)) break;
    const Change first = change_between(is_linear, from, middle);
    const Change second = change_between(is_linear, middle, to);
    const bool is_first = first.found - first.allowed > second.found - second.allowed;
    (is_first ? to : from) = middle;
  }
  const char* word = is_linear ? " the position moves by " : " the rotation changes by ";
  const Change last = change_between(is_linear, from, to);
  // A fast motion changes by nothing in no time; a jump keeps its full size.
  const bool is_jump = last.found - last.allowed > (whole.found - whole.allowed) / 2;
  if (!is_jump) {
    return fault(MotionFault::SpeedAboveBound, t, whole.found, whole.allowed, "until ", next, word,
                 whole.found, ", but twist_bound and rounding allow ", whole.allowed);
  }
  return fault(MotionFault::Jump, from, last.found, last.allowed, "between this time and ", to,
               word, last.found, ", but twist_bound and rounding allow ", last.allowed);
}

MaybeFault MotionProbe::check_speed(const TwistHalf& half, Scalar t,
                                    const TwistBound& bound) const {
  const Scalar speed = (motion_.twist(t).*half.rate).norm();
  const Scalar allowed = bound.*half.speed + (twist_noise_.*half.rate).x();
  if (!(speed > allowed)) return std::nullopt;
  return fault(MotionFault::SpeedAboveBound, t, speed, allowed, "the ", half.speed_word, " is ",
               speed, ", but twist_bound allows ", allowed);
}

// The twist that differences of the pose give, and which mistake would explain the one found.
std::string MotionProbe::explain(const TwistHalf& half, Scalar t) const {
  const Scalar step = kNumericTwist * spacing_;
  const Scalar inside = std::clamp(t, interval_.begin + 3 * step, interval_.end - 3 * step);
  const Vector3 found = motion_.twist(inside).*half.rate;
  const Vector3 real = motion_internal::twist_by_differences(motion_, inside, step).*half.rate;
  const Vector3 in_body = motion_.pose(inside).rotation().transpose() * real;
  const auto is_near = [&](const Vector3& x) { return (found - x).norm() <= 0.01 * real.norm(); };
  const char* slip = "";
  if (is_near(-real)) slip = "; its sign is reversed";
  if (!is_near(real) && is_near(in_body)) slip = "; it is expressed in the body, not in the world";
  return compose_message("twist gives ", half.field, " = (", found.transpose(),
                         "), differences of the pose give about (", real.transpose(), ")", slip);
}

// `displacement` is the change of the pose over s, `missed` its difference from what the twist
// predicts.
MaybeFault MotionProbe::check_half(const TwistHalf& half, Scalar t, Scalar s,
                                   const TwistBound& bound, Scalar displacement, Scalar missed,
                                   Scalar pose_noise) const {
  if (MaybeFault found = check_speed(half, t, bound)) return found;
  const Scalar late = 8 * kUnitRoundoff * std::abs(t);
  const Scalar noise = (twist_noise_.*half.rate).x();
  Scalar acceleration = bound.*half.acceleration;
  const Vector3 rate = motion_.twist(t).*half.rate;
  const Scalar change = (motion_.twist(t + s).*half.rate - rate).norm();
  const bool is_known = std::isfinite(acceleration);
  const Scalar may_change = acceleration * (s + late) + 2 * noise;
  if (is_known && change > may_change) {
    return fault(MotionFault::AccelerationAboveBound, t, change / s, may_change / s, "the ",
                 half.speed_word, " changes by ", change, " until t = ", t + s, ", at a rate of ",
                 change / s, ", but twist_bound allows the ", half.acceleration_word, " ",
                 acceleration);
  }
  // Without a bound: the change of the twist itself over a short time, generously.
  if (!is_known) {
    const bool is_telling = s < kShortStep * spacing_ && displacement > kTellingNoise * pose_noise;
    if (!is_telling) return std::nullopt;
    const Scalar middle = (motion_.twist(t + s / 2).*half.rate - rate).norm();
    acceleration = 8 * std::max(change, middle) / s + 0.5 * displacement / (s * s);
  }
  const Scalar may_miss =
      acceleration * s * s / 2 + s * noise + acceleration * s * late + pose_noise;
  if (!(missed > may_miss)) return std::nullopt;
  return fault(MotionFault::TwistNotDerivative, t, missed, may_miss,
               "the twist is not the derivative of the pose: over a time of ", s,
               " they differ by ", missed, ", but twist_bound and rounding allow ", may_miss, "; ",
               explain(half, t));
}

// One step s from t, within a smooth piece.
MaybeFault MotionProbe::check_step(Scalar t, Scalar s) const {
  const TwistBound bound = motion_.twist_bound({t, t + s});
  const RigidPose X = motion_.pose(t);
  const RigidPose Y = motion_.pose(t + s);
  const Twist twist = motion_.twist(t);
  const Vector3 moved = Y.translation() - X.translation();
  if (MaybeFault found = check_half(kLinear, t, s, bound, moved.norm(),
                                    (moved - s * twist.v_WB).norm(), position_noise_)) {
    return found;
  }
  const Matrix3 steady = rotation_from_vector(s * twist.w_WB) * X.rotation();
  const Scalar missed = (Y.rotation() - steady).colwise().norm().maxCoeff();
  const Scalar turned = (Y.rotation() - X.rotation()).colwise().norm().maxCoeff();
  return check_half(kAngular, t, s, bound, turned, missed, rotation_noise_);
}

// After s, within the interval.
MaybeFault MotionProbe::check_stretch(const MotionStretch& stretch, Scalar t, Scalar s) const {
  const RigidPose X = motion_.pose(t);
  const RigidPose Y = motion_.pose(t + s);
  const Scalar exact = (t + s) - t;
  const auto differs = [&](const char* word, Scalar found, Scalar allowed) -> MaybeFault {
    if (!(found > allowed)) return std::nullopt;
    return fault(MotionFault::StretchExceeded, t, found, allowed, "after ", exact, " the ", word,
                 " differs from its stretch until ", stretch.end, " by ", found,
                 ", but that and rounding allow ", allowed);
  };
  const Vector3 moved = Y.translation() - X.translation();
  if (MaybeFault found = differs("position", (moved - exact * stretch.twist.v_WB).norm(),
                                 stretch.linear_deviation + position_noise_ +
                                     stretch.linear_acceleration * (exact * exact / 2))) {
    return found;
  }
  const Matrix3 steady = rotation_from_vector(exact * stretch.twist.w_WB) * X.rotation();
  return differs("rotation", (Y.rotation() - steady).colwise().norm().maxCoeff(),
                 stretch.angular_deviation + rotation_noise_ +
                     stretch.angular_acceleration * (exact * exact / 2));
}

MaybeFault MotionProbe::check_stretches(Scalar t) const {
  constexpr int kMost = 64;  // more than a log of any length has
  Scalar after = motion_.smooth_until(t);
  for (int i = 0; i < kMost && after < interval_.end; ++i) {
    const std::optional<MotionStretch> stretch = motion_.stretch(t, after);
    if (!stretch) break;
    if (!(stretch->end > after)) {
      return fault(MotionFault::StretchExceeded, t, stretch->end, after,
                   "a stretch must end after ", after, ", not at ", stretch->end);
    }
    after = stretch->end;
    const Scalar s = std::min(after, interval_.end) - t;
    for (const Scalar part : {s, s / 2}) {
      if (MaybeFault found = check_stretch(*stretch, t, part)) return found;
    }
  }
  return std::nullopt;
}

MaybeFault MotionProbe::check_between(Scalar t, Scalar next) const {
  if (MaybeFault found = check_bound({t, next})) return found;
  if (MaybeFault found = check_piece(t, next)) return found;
  if (MaybeFault found = check_displacement(true, t, next)) return found;
  if (MaybeFault found = check_displacement(false, t, next)) return found;
  if (MaybeFault found = check_stretches(t)) return found;
  // literal: a little before the end of the piece, so that t + s, rounded, is not beyond it.
  const Scalar end = motion_.smooth_until(t);
  Scalar s = (std::min(end, next) - t) * (1 - 1e-9);
  for (int i = 0; i < kStepCount && t + s > t; ++i, s *= kStepRatio) {
    const Scalar exact = (t + s) - t;  // the exact time between the two arguments
    if (!(t + exact < end)) continue;
    if (MaybeFault found = check_step(t, exact)) return found;
  }
  return std::nullopt;
}

MotionCheck MotionProbe::run() {
  if (MaybeFault found = check_domain()) return *found;
  if (MaybeFault found = check_instant_or_refusal(interval_.begin)) return *found;
  // The motion can be checked further up to its first unsound sample.
  const auto is_unsound = [&](Scalar t) { return check_instant_or_refusal(t).has_value(); };
  const auto end = std::find_if(times_.begin(), times_.end(), is_unsound);
  MaybeFault unsound;
  if (end != times_.end()) {
    unsound = check_instant_or_refusal(first_bad(*(end - 1), *end, is_unsound));
    times_.erase(end, times_.end());
  }
  Scalar t = interval_.begin;
  try {
    measure_size();
    for (std::size_t i = 1; i < times_.size(); ++i) {
      t = times_[i - 1];
      if (MaybeFault found = check_between(t, times_[i])) return *found;
    }
  } catch (const Error& error) {
    return fault(MotionFault::Refused, t, 0, 0, "a member throws: ", error.what());
  }
  return unsound.value_or(MotionCheck{});
}

}  // namespace

MotionCheck check_motion(const Motion& motion, const TimeInterval& interval,
                         const MotionCheckOptions& options) {
  require_valid(interval, "check_motion: interval");
  DYOP_REQUIRE(interval.length() > 0, "check_motion: the interval [", interval.begin, ", ",
               interval.end, "] has no length");
  DYOP_REQUIRE(options.sample_count >= 2, "check_motion: sample_count must be >= 2, not ",
               options.sample_count);
  return MotionProbe(motion, interval, options).run();
}

}  // namespace dyop
