#pragma once

#include "dyop/core/rigid_pose.h"
#include "dyop/distance/distance_result.h"
#include "dyop/geometry/convex_shape.h"

namespace DYOP_EXPORT dyop {

/// Answer of gjk_distance(), everything in frame A of the first shape.
struct GjkResult {
  Scalar lower = 0;          ///< never above the true distance of the rounded shapes, >= 0
  Scalar upper = kInfinity;  ///< never below it
  Vector3 p_ACa = Vector3::Zero();
  Vector3 p_ACb = Vector3::Zero();
  /// Unit direction from a to b whose slab gap proves `lower`; the best known when lower is 0.
  Vector3 nhat_AB_A = Vector3::UnitX();
  Feature feature_a;
  Feature feature_b;
  bool is_overlapping = false;  ///< proven: the shapes touch or intersect, up to gjk noise
  int iterations = 0;
};

/// Returns the distance of two convex shapes, with a certificate on both sides.
///
/// The lower bound is the slab gap along the best direction met, evaluated through the support
/// functions and rounded down; the upper bound is the length between points of the shapes, rounded
/// up. So both hold whatever the iteration does; only their difference depends on convergence.
///
/// @param X_AB Pose of b's frame in a's frame.
/// Bounded number of iterations, no allocation. See [GilbertJohnsonKeerthi1988],
/// [vandenBergen2003], docs/algorithms/gjk.md.
GjkResult gjk_distance(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB);

}  // namespace dyop
