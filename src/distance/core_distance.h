// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "dyop/core/rigid_pose.h"
#include "dyop/core/types.h"
#include "dyop/distance/distance_result.h"
#include "dyop/geometry/convex_shape.h"

namespace dyop::distance_internal {

/// |v|, or more where its square underflows: an allowance for rounding must not be lost with it.
inline Scalar length_for_noise(const Vector3& v) {
  const Scalar norm = v.norm();
  return norm > 0x1p-500 ? norm : v.lpNorm<1>();  // literal: its square is far from underflow
}

/// Where the two shapes stand: the axes of both in one frame F, and the vector between their
/// origins. The origin of the answers is that of A.
struct CorePlaces {
  const Matrix3& R_FA;
  const Matrix3& R_FB;
  Vector3 p_AB_F;
  bool is_in_a = false;  ///< R_FA is the identity
};

/// The distance of two rounded simple cores in closed form, with both bounds, in frame F from the
/// origin of A on: one look-up in a table of pairs of kinds, which also serves the other order.
///
/// Returns false, with nothing known, if a core is General, and where the certificate fails: near
/// contact of nearly parallel edges, for boxes that overlap with no corner of one in the other, and
/// for sizes whose squares leave the range of double. The caller then takes gjk_distance().
///
/// `lower` is the slab gap along nhat_AB, `upper` the length of the witness segment; both are
/// widened by kPoseNoise times the size of the pair. docs/algorithms/distance.md, "Simple shapes".
bool core_distance(const SimpleCore& a, const SimpleCore& b, const CorePlaces& places,
                   NearestPoints& result);

/// The distance of a triangle, A, and a rounded point or segment, B, by the kernels for a point and
/// a triangle and for two triangles; false for other cores. All in A's frame; features with local
/// vertex numbers. Bounds allow for all rounding but that of the pose.
bool triangle_core_distance(const Triangle& a, const SimpleCore& b, const RigidPose& X_AB,
                            NearestPoints& result);

/// A half-space and another convex shape, in frame A.
struct HalfSpaceGap {
  Vector3 normal = Vector3::UnitX();  ///< of the plane: unit, out of the half-space
  Vector3 lowest = Vector3::Zero();   ///< the other shape's point that is lowest above the plane
  Feature feature;                    ///< of that point
  Scalar height = 0;                  ///< of that point: negative inside
  Scalar noise = 0;                   ///< of the height
  bool is_of_b = false;               ///< the half-space

  /// As gjk_distance() gives them.
  NearestPoints nearest() const;
};

/// Nothing unless one of the shapes is a half-space.
std::optional<HalfSpaceGap> half_space_gap(const ConvexShape& a, const ConvexShape& b,
                                           const RigidPose& X_AB);

}  // namespace dyop::distance_internal
