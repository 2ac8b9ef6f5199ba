// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <vector>

#include "dyop/motion/sampled_motion.h"
#include "support/inputs/random_inputs.h"

/// Logs of poses as devices and robots write them.
namespace dyop::testing {

using PoseLog = std::vector<SampledMotion::Sample>;

/// A smooth path over [begin, begin + span]: once around a tilted ellipse of about the radius, while
/// the body turns by `turn`.
inline PoseLog smooth_log(std::size_t count, Scalar radius, Scalar turn, Scalar begin = 0,
                          Scalar span = 1, const Vector3& center = Vector3::Zero()) {
  const Vector3 axis = Vector3(0.3, -0.5, 0.8).normalized();
  PoseLog log;
  for (std::size_t i = 0; i < count; ++i) {
    const Scalar s = static_cast<Scalar>(i) / static_cast<Scalar>(count - 1);
    const Scalar angle = 2 * std::numbers::pi * s;
    const Vector3 p(radius * std::cos(angle), 1.1 * radius * std::sin(angle),
                    0.2 * radius * std::sin(2 * angle));
    log.push_back({begin + s * span, RigidPose(rotation_from_vector(turn * s * axis), center + p)});
  }
  return log;
}

/// The same with an error of up to `length` in positions and `angle` in rotations.
inline PoseLog noisy(PoseLog log, Scalar length, Scalar angle, std::mt19937_64& random) {
  for (SampledMotion::Sample& sample : log) {
    const Matrix3 R = rotation_from_vector(angle * random_vector(1, random));
    sample.X_WB = RigidPose(Matrix3(sample.X_WB.rotation() * R),
                            sample.X_WB.translation() + length * random_vector(1, random));
  }
  return log;
}

/// A random walk of steps that are of about `step` and `turn`, but often zero, half turns or much
/// larger, at stamps that are uneven and sometimes 1e-9 of the others apart.
inline PoseLog erratic_log(std::size_t count, Scalar step, Scalar turn, Scalar begin, Scalar span,
                           const Vector3& start, std::mt19937_64& random) {
  PoseLog log{{begin, RigidPose(random_pose(1, random).rotation(), start)}};
  const auto chance = [&](Scalar share) { return random_number(0, 1, random) < share; };
  while (log.size() < count) {
    const Scalar rest = span / static_cast<Scalar>(count);
    const Scalar wait = rest * (chance(0.1) ? 1e-9 : random_number(0.2, 1.8, random));
    const RigidPose& last = log.back().X_WB;
    Vector3 theta = turn * random_vector(1, random);
    if (chance(0.05)) theta = std::numbers::pi * random_vector(1, random).normalized();
    Vector3 move = step * random_vector(1, random);
    if (chance(0.05)) move *= 20;
    const bool stays = chance(0.2);
    const RigidPose next(Matrix3(last.rotation() * rotation_from_vector(theta)),
                         last.translation() + move);
    const Scalar t = log.back().t;
    log.push_back({std::max(t + wait, std::nextafter(t, kInfinity)), stays ? last : next});
  }
  return log;
}

}  // namespace dyop::testing
