// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "dyop/dynamics/rigid_body.h"

namespace dyop::io_internal {

/// Pulls a point P of a body towards a point A of the world: force -stiffness * (P - A) - damping *
/// v_P.
struct SpringForce {
  Vector3 p_BP = Vector3::Zero();
  Vector3 p_WA = Vector3::Zero();
  Scalar stiffness = 0;  ///< force per length
  Scalar damping = 0;    ///< force per speed
};

/// All forces on one body except gravity.
struct BodyForces {
  Wrench constant;
  std::vector<SpringForce> springs;
  Scalar linear_drag = 0;   ///< force per speed of the centre of mass
  Scalar angular_drag = 0;  ///< torque per angular speed
};

/// The sum of the forces as a callback. @param p_BoBcm centre of mass in the body's frame.
WrenchCallback make_wrench(const BodyForces& forces, const Vector3& p_BoBcm);

}  // namespace dyop::io_internal
