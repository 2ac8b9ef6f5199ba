#pragma once

#include <deque>
#include <memory>

#include "dyop/dynamics/rigid_body.h"

namespace dyop::internal {

/// A body of a World with all that changes as it is stepped.
struct BodyRecord {
  BodyDefinition definition;
  MotionState state;
  bool is_settled = false;          ///< put to rest by the Zeno guard
  std::deque<Scalar> impact_times;  ///< of the recent impacts, for the Zeno guard

  /// Moved by forces now: part of the differential equations.
  bool is_active() const { return definition.kind == BodyKind::Dynamic && !is_settled; }
  bool may_move() const { return is_active() || definition.kind == BodyKind::Kinematic; }

  Vector3 center_of_mass() const { return state.X_WB * definition.mass_properties.p_BoBcm; }
  Vector3 center_velocity() const {
    return state.twist.v_WB +
           state.twist.w_WB.cross(state.X_WB.rotation() * definition.mass_properties.p_BoBcm);
  }
  Matrix3 inertia_W() const {
    const Matrix3& R = state.X_WB.rotation();
    return R * definition.mass_properties.I_BBcm * R.transpose();
  }
};

/// Pose and twist of the frame B of a body from those of its centre of mass.
MotionState body_state(const MassProperties& properties, const Matrix3& R_WB, const Vector3& p_WBcm,
                     const Vector3& v_WBcm, const Vector3& w_WB);

}  // namespace dyop::internal
