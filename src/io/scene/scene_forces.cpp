// SPDX-License-Identifier: BSD-3-Clause
#include "io/scene/scene_forces.h"

namespace dyop::io_internal {
namespace {

// Force and torque about the centre of mass of one spring.
Wrench evaluate(const SpringForce& spring, const MotionState& state, const Vector3& p_WBcm) {
  const Vector3 p_BoP_W = state.X_WB.rotation() * spring.p_BP;
  const Vector3 p_WP = state.X_WB.translation() + p_BoP_W;
  const Vector3 v_WP = state.twist.v_WB + state.twist.w_WB.cross(p_BoP_W);
  Wrench wrench;
  wrench.force = -spring.stiffness * (p_WP - spring.p_WA) - spring.damping * v_WP;
  wrench.torque = (p_WP - p_WBcm).cross(wrench.force);
  return wrench;
}

}  // namespace

WrenchCallback make_wrench(const BodyForces& forces, const Vector3& p_BoBcm) {
  return [forces, p_BoBcm](Scalar /*t*/, const MotionState& state) {
    const Vector3 p_BoBcm_W = state.X_WB.rotation() * p_BoBcm;
    const Vector3 p_WBcm = state.X_WB.translation() + p_BoBcm_W;
    const Vector3 v_WBcm = state.twist.v_WB + state.twist.w_WB.cross(p_BoBcm_W);
    Wrench sum = forces.constant;
    sum.force -= forces.linear_drag * v_WBcm;
    sum.torque -= forces.angular_drag * state.twist.w_WB;
    for (const SpringForce& spring : forces.springs) {
      const Wrench wrench = evaluate(spring, state, p_WBcm);
      sum.force += wrench.force;
      sum.torque += wrench.torque;
    }
    return sum;
  };
}

}  // namespace dyop::io_internal
