// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <random>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/motion/bezier_motion.h"

namespace dyop::testing {

/// Random numbers of the motion tests from a fixed seed.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  Scalar uniform(Scalar low, Scalar high) {
    return std::uniform_real_distribution<Scalar>(low, high)(engine_);
  }
  Vector3 direction() {
    std::normal_distribution<Scalar> normal;
    return Vector3(normal(engine_), normal(engine_), normal(engine_)).normalized();
  }
  /// Uniform direction, length in [0, radius].
  Vector3 in_ball(Scalar radius) { return uniform(0, radius) * direction(); }
  Matrix3 rotation() { return rotation_from_vector(uniform(0, 3.1) * direction()); }
  RigidPose pose(Scalar radius) { return RigidPose(rotation(), in_ball(radius)); }

 private:
  std::mt19937_64 engine_;
};

inline std::vector<ControlPoint> random_points(Random& random, std::size_t count) {
  std::vector<ControlPoint> points;
  for (std::size_t i = 0; i < count; ++i) {
    points.push_back({random.in_ball(3), random.in_ball(2)});
  }
  return points;
}

}  // namespace dyop::testing
