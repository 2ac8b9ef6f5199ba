// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/spring_state.h"

#include "dyop/core/error.h"

namespace dyop::dynamics_internal {

Vector3 spring_vector(const SpringDefinition& spring, const RigidPose& X_WA,
                      const RigidPose& X_WB) {
  return X_WB * spring.p_BQ - X_WA * spring.p_AP;
}

Scalar spring_energy(const SpringState& spring, const Vector3& p_PQ_W) {
  const Scalar stretch = p_PQ_W.norm() - spring.rest_length();
  return spring.definition.stiffness * stretch * stretch / 2;
}

void require_valid(const SpringDefinition& spring) {
  const auto& name = spring.name;
  DYOP_REQUIRE(spring.a != spring.b, "spring '", name, "': it needs two bodies, not ", spring.a,
               " twice");
  DYOP_REQUIRE(spring.p_AP.allFinite() && spring.p_BQ.allFinite(), "spring '", name,
               "': its points must be finite");
  const auto require_number = [&](Scalar value, const char* what) {
    DYOP_REQUIRE(value >= 0 && value < kInfinity, "spring '", name, "': ", what,
                 " must be finite and >= 0, not ", value);
  };
  require_number(spring.stiffness, "stiffness");
  require_number(spring.damping, "damping");
  require_number(spring.rest_length.value_or(0), "rest length");
  DYOP_REQUIRE(spring.stiffness > 0 || spring.damping > 0, "spring '", name,
               "': stiffness or damping must be > 0");
}

}  // namespace dyop::dynamics_internal
