// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>

#include "dyop/dynamics/rigid_body.h"
#include "dyop/dyop_c.h"
#include "dyop/motion/motion.h"
#include "dyop/toi/toi_result.h"

// Converts values between C and C++.
namespace dyop::c {

inline Vector3 vector_from(const double (&x)[3]) {
  return {x[0], x[1], x[2]};
}

inline void write_vector(const Vector3& x, double (&out)[3]) {
  std::copy(x.begin(), x.end(), out);
}

inline RigidPose pose_from(const dyop_pose& pose) {
  const double* q = pose.rotation;
  return RigidPose(Quaternion(q[0], q[1], q[2], q[3]), vector_from(pose.position));
}

inline dyop_pose to_c(const RigidPose& X) {
  const Quaternion q = X.quaternion();
  dyop_pose pose{{}, {q.w(), q.x(), q.y(), q.z()}};
  write_vector(X.translation(), pose.position);
  return pose;
}

inline MotionState state_from(const dyop_state& state) {
  return {pose_from(state.pose), {vector_from(state.twist.v), vector_from(state.twist.w)}};
}

inline dyop_state to_c(const MotionState& state) {
  dyop_state result{to_c(state.X_WB), {}};
  write_vector(state.twist.v_WB, result.twist.v);
  write_vector(state.twist.w_WB, result.twist.w);
  return result;
}

inline TimeInterval interval_from(const dyop_interval& interval) {
  return {interval.begin, interval.end};
}

inline dyop_witness to_c(const WitnessPair& pair) {
  dyop_witness witness{};
  witness.lower = pair.lower;
  witness.upper = pair.upper;
  write_vector(pair.p_WCa, witness.point_a);
  write_vector(pair.p_WCb, witness.point_b);
  write_vector(pair.nhat_AB_W, witness.normal);
  witness.triangle_a = pair.triangle_a.value_or(-1);
  witness.triangle_b = pair.triangle_b.value_or(-1);
  witness.child_a = pair.child_a.value_or(-1);
  witness.child_b = pair.child_b.value_or(-1);
  return witness;
}

// Numbers of obstacles, joints and springs start at 1, so that zero refers to none.
template <typename Handle, typename Id>
Handle numbered(Id id) {
  return {std::uint64_t(id) + 1};
}

// Handles of bodies start at generation 1, so that zero refers to none.
inline dyop_body to_c(const BodyId& id) {
  return {id.slot, id.generation + 1};
}

inline BodyId body_from(dyop_body body) {
  return BodyId(body.index, body.generation - 1);
}

// Throws InvalidArgument.
template <typename Pointer>
Pointer* require_given(Pointer* pointer, const char* what) {
  DYOP_REQUIRE(pointer, what, " must not be null");
  return pointer;
}

}  // namespace dyop::c
