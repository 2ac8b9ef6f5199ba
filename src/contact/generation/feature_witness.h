// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "dyop/core/triangle.h"
#include "dyop/core/types.h"
#include "dyop/geometry/shape.h"

namespace dyop::contact_internal {

/// Where the point of a triangle nearest to another point lies.
struct TriangleFoot {
  FeatureKind kind = FeatureKind::Face;
  /// What the point lies on; with kind Face, a corner or side if the foot is slightly off the
  /// triangle.
  FeatureKind place = FeatureKind::Face;
  int index = 0;  ///< of the corner, or of the side that starts at it
  Vector3 point = Vector3::Zero();
  /// With kind Face: unit normal of the triangle, on the side of the other point.
  Vector3 normal = Vector3::UnitX();
  /// With kind Face: the other point is on the outer side, by the triangle's winding.
  bool is_outer = true;
};

/// The point of `t` nearest to `p`, or nothing if it is certainly farther than `reach`. A foot that
/// is off the triangle by no more than `border_sine` times the height, or by `noise`, counts as on
/// the face.
std::optional<TriangleFoot> find_foot(const Triangle& t, const Vector3& p, Scalar reach,
                                      Scalar border_sine, Scalar noise);

/// The common perpendicular of two segments.
struct EdgeCrossing {
  Vector3 p_a = Vector3::Zero();
  Vector3 p_b = Vector3::Zero();
  Vector3 normal = Vector3::UnitX();  ///< unit, perpendicular to both, either sign
  Scalar sine = 0;                    ///< of the angle between the segments
};

/// Nothing if a foot is off its segment by more than `noise`, if the lines are farther apart than
/// `reach`, or if they are parallel to within kContactNoCrossingSine.
std::optional<EdgeCrossing> find_crossing(const Vector3& a0, const Vector3& a1, const Vector3& b0,
                                          const Vector3& b1, Scalar reach, Scalar noise);

}  // namespace dyop::contact_internal
