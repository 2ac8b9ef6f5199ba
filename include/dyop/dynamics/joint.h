// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <string>

#include "dyop/core/rigid_pose.h"
#include "dyop/dynamics/body_id.h"

namespace DYOP_EXPORT dyop {

/// Identifies a joint of one World; never reused after the joint was removed.
struct JointId {
  std::uint64_t number = ~std::uint64_t{0};
  friend auto operator<=>(const JointId&, const JointId&) = default;
};

/// What a joint holds of its two frames JA (on A) and JB (on B).
enum class JointKind {
  Ball,      ///< origins together
  Hinge,     ///< origins and z axes together; the bodies turn about z
  Slider,    ///< axes together, origins on A's z axis; B moves along it
  Fixed,     ///< origins and axes together
  Distance,  ///< origins at a distance
};

/// Range of a Hinge (angle of JB about z of JA, radians, within (-pi, pi)), Slider (position of JB
/// along z of JA, length) or Distance (length, min > 0).
struct JointLimits {
  Scalar min = 0;
  Scalar max = 0;
};

/// Drives a Hinge (radians per time, torque) or a Slider (length per time, force).
struct JointMotor {
  Scalar speed = 0;
  Scalar strength = 0;  ///< largest torque or force, > 0
};

/// Two bodies held together, at least one of them Dynamic; passed to World::add_joint().
struct JointDefinition {
  std::string name;
  JointKind kind = JointKind::Ball;
  BodyId a;
  BodyId b;
  RigidPose X_AJ;                     ///< frame JA in the frame of A
  RigidPose X_BJ;                     ///< frame JB in the frame of B
  std::optional<JointLimits> limits;  ///< Hinge, Slider; Distance: none holds the initial one
  std::optional<JointMotor> motor;    ///< Hinge, Slider
  bool bodies_collide = false;        ///< false: the pair is not examined while joined
};

}  // namespace dyop
