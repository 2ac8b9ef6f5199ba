#pragma once

#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/mesh_hierarchy.h"

namespace dyop::internal {

/// A separating direction of two boxes and how far apart they are along it.
struct BoxGap {
  Scalar gap = -kInfinity;               ///< slab gap along nhat, rounded down; <= 0: not separated
  Vector3 nhat_AB_A = Vector3::UnitX();  ///< unit, from A to B, in frame A
};

/// Returns the largest slab gap of two oriented boxes over their 15 separating axes and the line
/// of centres: a proven lower bound of the distance of what they contain ([Gottschalk1996]; the
/// normalised gap as a distance bound, docs/algorithms/distance.md).
///
/// @param X_AB  Pose of b's shape frame in a's shape frame.
/// @param noise Rounding allowance for a coordinate, subtracted from every gap before it is divided
///              by the length of its axis.
BoxGap box_gap(const OrientedBox& a, const OrientedBox& b, const RigidPose& X_AB, Scalar noise);

}  // namespace dyop::internal
