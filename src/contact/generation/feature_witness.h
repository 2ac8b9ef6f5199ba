// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "dyop/core/triangle.h"
#include "dyop/core/types.h"
#include "dyop/geometry/shape.h"

namespace dyop::internal {

/// Where on a triangle the nearest point to another point lies.
struct TriangleFoot {
  FeatureKind kind = FeatureKind::Face;
  /// What the point lies on; for kind Face a corner or side if the foot is a little off the triangle.
  FeatureKind place = FeatureKind::Face;
  int index = 0;  ///< of that corner, or of the side from that corner to the next
  Vector3 point = Vector3::Zero();
  /// Unit normal of the triangle on the side of the other point; for kind Face.
  Vector3 normal = Vector3::UnitX();
  /// The other point lies on the side the triangle's winding calls outer, for kind Face.
  bool is_outer = true;
};

/// The nearest point of `t` to `p`, or nothing if it is farther than `reach` for certain. A foot
/// that is off the triangle by no more than `border_sine` of the height, or by `noise`, counts as on
/// the face.
std::optional<TriangleFoot> find_foot(const Triangle& t, const Vector3& p, Scalar reach,
                                      Scalar border_sine, Scalar noise);

/// The common perpendicular of two segments.
struct EdgeCrossing {
  Vector3 p_a = Vector3::Zero();
  Vector3 p_b = Vector3::Zero();
  Vector3 normal = Vector3::UnitX();  ///< unit, square to both, either way round
  Scalar sine = 0;                    ///< of the angle between them
};

/// Nothing if a foot is off its segment by more than `noise`, they are farther apart than `reach`, or
/// parallel to kContactNoCrossingSine.
std::optional<EdgeCrossing> find_crossing(const Vector3& a0, const Vector3& a1, const Vector3& b0,
                                          const Vector3& b1, Scalar reach, Scalar noise);

}  // namespace dyop::internal
