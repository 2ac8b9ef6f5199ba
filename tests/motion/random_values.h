#pragma once

#include <random>

#include "dyop/core/rigid_pose.h"

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

}  // namespace dyop::testing
