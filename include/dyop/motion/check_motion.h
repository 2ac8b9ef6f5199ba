// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "dyop/motion/motion.h"

namespace DYOP_EXPORT dyop {

/// The promise of Motion that was broken.
enum class MotionFault {
  Domain,                  ///< not defined on all of the interval
  Refused,                 ///< a member function threw a dyop::Error
  PoseNotFinite,           ///< a position or rotation that is infinite or NaN
  PoseNotRotation,         ///< a rotation matrix that scales, shears or mirrors
  TwistNotFinite,          ///< a velocity that is infinite or NaN
  StateDiffers,            ///< state() is not what pose() and twist() return
  BoundNotValid,           ///< a twist_bound that is negative or NaN
  SmoothUntil,             ///< smooth_until() is not after t, or sooner than stated before
  Jump,                    ///< the pose moves farther than the bound on speed allows
  TwistNotDerivative,      ///< the twist is not the derivative of the pose
  SpeedAboveBound,         ///< a twist larger than twist_bound
  AccelerationAboveBound,  ///< a twist that changes faster than twist_bound
  StretchExceeded,         ///< a pose that strays farther than stretch() allows
};

struct MotionCheckOptions {
  /// Number of times at which the motion is sampled, >= 2, the start and the end included. A fault
  /// shorter than the time between samples can go unseen.
  int sample_count = 1000;
  /// Shifts the sample times between start and end: another seed samples at other times.
  std::uint64_t seed = 1;
};

/// Result of check_motion().
struct MotionCheck {
  std::optional<MotionFault> fault;  ///< none: nothing wrong was found
  Scalar t = 0;                      ///< when; for a jump, just before it
  Scalar found = 0;                  ///< the wrong value, in the unit of the promise
  Scalar allowed = 0;                ///< the largest value allowed
  std::string message;               ///< what, when and by how much, in words; empty if no fault

  bool is_sound() const { return !fault; }
};

/// Samples a motion over an interval, as dyop's own tests sample the motions of the library, and
/// names the first promise of Motion that it breaks, in order of time.
///
/// What is checked is what the impact engine relies on, with the motion's own bounds. With v, a the
/// bounds on speed and acceleration over a part [t, t + s] without a jump of the twist,
///     |p(t + s) - p(t)| <= v s,
///     |p(t + s) - p(t) - s v(t)| <= a s^2 / 2,
///     |v(t + s) - v(t)| <= a s
/// up to rounding, for many s from the time between samples down; the same for rotations. So a
/// motion that keeps its promises is never reported, whatever its form. A wrong twist is detected
/// down to about 1e-7 of the speed if the bound on acceleration is close to the true one. Where
/// that bound is infinite, twists are compared roughly, over 1/256 of the time between samples and
/// less.
///
/// Use it in the tests of your own motions; it finds faults, but does not prove their absence.
/// @throws InvalidArgument if the interval is not finite, is reversed or has no length, or
///         sample_count < 2. Exceptions that are not a dyop::Error pass through.
/// Cost: about 40 poses and twists and 12 bounds per sample.
MotionCheck check_motion(const Motion& motion, const TimeInterval& interval,
                         const MotionCheckOptions& options = {});

}  // namespace dyop
