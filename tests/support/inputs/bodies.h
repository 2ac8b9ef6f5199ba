// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/steady_motions.h"

/// Short names for poses and motions of bodies.
namespace dyop::testing {

/// Translated, not rotated.
inline RigidPose at(Scalar x, Scalar y, Scalar z) {
  return RigidPose(Vector3(x, y, z));
}

/// From the given pose on, with velocity v and angular velocity w.
inline ConstantTwistMotion moving(const RigidPose& X_WB, const Vector3& v,
                                  const Vector3& w = Vector3::Zero()) {
  return ConstantTwistMotion(X_WB, Twist{v, w});
}

/// A segment and a point, as meshes of one degenerate triangle.
inline TriangleMesh segment_mesh(const Vector3& from, const Vector3& to) {
  return TriangleMesh({from, to}, {{0, 1, 1}});
}

inline TriangleMesh point_mesh(const Vector3& p) {
  return TriangleMesh({p}, {{0, 0, 0}});
}

}  // namespace dyop::testing
