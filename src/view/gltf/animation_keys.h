// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dyop/io/recording_reader.h"

/// The path of a body as keys of glTF's cubic splines.
namespace dyop::view_internal {

using Vector4 = Eigen::Matrix<Scalar, 4, 1>;  // a quaternion, x y z w

struct AnimationKey {
  float t = 0;
  Vector3 p = Vector3::Zero();
  Vector3 v_in = Vector3::Zero();  // before t, and from t on
  Vector3 v_out = Vector3::Zero();
  Vector4 q = Vector4::UnitW();  // unit; the sign goes on that of the key before
  Vector4 q_rate_in = Vector4::Zero();
  Vector4 q_rate_out = Vector4::Zero();
};

/// When the body is there. Outside, its keys mean nothing.
struct PresenceChange {
  float t = 0;
  bool is_there = true;
};

struct BodyAnimation {
  std::vector<AnimationKey> keys;  // times strictly increasing; one: it never moves
  std::vector<PresenceChange> changes;
};

/// @param tolerance Of poses: length, also of what a rotation moves at the shape's radius.
BodyAnimation animation_of(const RecordingReader& reader, BodyId body, Scalar tolerance);

}  // namespace dyop::view_internal
