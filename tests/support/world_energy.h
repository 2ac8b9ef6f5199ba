// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/dynamics/world.h"

namespace dyop::testing {

/// Kinetic and potential energy of all bodies that move.
inline Scalar energy(const World& world, const Vector3& gravity_W) {
  Scalar sum = world.kinetic_energy();
  for (const BodyId id : world.bodies()) {
    const BodyDefinition& body = world.body(id);
    if (body.kind != BodyKind::Dynamic) continue;
    const Vector3 p_WBcm = world.state(id).X_WB * body.mass_properties.p_BoBcm;
    sum -= body.mass_properties.mass * gravity_W.dot(p_WBcm);
  }
  return sum;
}

}  // namespace dyop::testing
