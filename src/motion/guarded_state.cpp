// SPDX-License-Identifier: BSD-3-Clause
#include "motion/guarded_state.h"

#include "dyop/core/error.h"

namespace dyop::motion_internal {
namespace {

// Returns the result of `action`; prefixes its error message with the time.
template <typename Action>
auto with_time(const Action& action, Scalar t, const char* what) {
  try {
    return action();
  } catch (const InvalidArgument& error) {
    throw InvalidArgument(compose_message(what, " at t = ", t, ": ", error.what()));
  }
}

}  // namespace

void refuse(const MotionState& state, Scalar t, const char* what) {
  const Matrix3& R = state.X_WB.rotation();
  DYOP_REQUIRE(is_finite(state.X_WB.translation()), what, " at t = ", t,
               ": the position is not finite: (", state.X_WB.translation().transpose(), ")");
  DYOP_REQUIRE(R.allFinite(), what, " at t = ", t, ": the rotation is not finite: (", R, ")");
  DYOP_REQUIRE(R.determinant() > 0, what, " at t = ", t, ": the rotation mirrors: R = (", R, ")");
  DYOP_REQUIRE(is_rotation(R), what, " at t = ", t,
               ": the pose is not a rotation: R^T R is off by ",
               (R.transpose() * R - Matrix3::Identity()).cwiseAbs().maxCoeff(), ", R = (", R, ")");
  throw InvalidArgument(compose_message(what, " at t = ", t, ": the twist is not finite: v = (",
                                        state.twist.v_WB.transpose(), "), w = (",
                                        state.twist.w_WB.transpose(), ")"));
}

MotionState checked_state(const Motion& motion, Scalar t, const char* what) {
  const MotionState state = with_time([&] { return motion.state(t); }, t, what);
  if (!is_rotation(state.X_WB.rotation())) refuse(state, t, what);
  return state;
}

RigidPose guarded_pose(const Motion& motion, Scalar t, const char* what) {
  const MotionState state{with_time([&] { return motion.pose(t); }, t, what), {}};
  if (!is_finite(state) || !is_rotation(state.X_WB.rotation())) [[unlikely]]
    refuse(state, t, what);
  return state.X_WB;
}

void refuse_jump(const PoseStep& step, Scalar speed, const char* what) {
  throw InvalidArgument(compose_message(
      what, " jumps between t = ", step.t_from, " and t = ", step.t_to, ": from position (",
      step.p_from.transpose(), ") to (", step.p_to.transpose(), "), rotation (", step.R_from,
      ") to (", step.R_to, "), but its twist_bound allows only a speed of ", speed));
}

}  // namespace dyop::motion_internal
