// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/types.h"

namespace DYOP_EXPORT dyop {

/// Mass, centre of mass and inertia of a body, in the frame B of its shape.
struct MassProperties {
  Scalar mass = 0;                    ///< > 0
  Vector3 p_BoBcm = Vector3::Zero();  ///< centre of mass
  Matrix3 I_BBcm = Matrix3::Zero();   ///< rotational inertia about the centre of mass, axes of B
};

/// The same mass distribution scaled to a given total mass.
/// @throws InvalidArgument unless mass is finite and positive.
MassProperties with_mass(const MassProperties& properties, Scalar mass);

}  // namespace dyop
