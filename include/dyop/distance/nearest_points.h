// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/types.h"
#include "dyop/geometry/shape.h"

namespace DYOP_EXPORT dyop {

/// Nearest points of two pieces a and b with bounds on their distance d: lower <= d <= upper.
/// Points and normal are in the frame of the query, which the function states.
struct NearestPoints {
  Scalar lower = 0;               ///< never above d; 0 if not proven positive
  Scalar upper = kInfinity;       ///< never below d
  Vector3 p_a = Vector3::Zero();  ///< witness point on a, within rounding
  Vector3 p_b = Vector3::Zero();  ///< witness point on b, within rounding
  /// Unit vector from a to b whose slab gap min_b n.x - max_a n.x proves `lower`; when lower is 0
  /// the best separating direction known, still unit.
  Vector3 nhat_AB = Vector3::UnitX();
  Feature feature_a;
  Feature feature_b;
  bool is_overlapping = false;  ///< found to touch or intersect: upper is rounding noise
};

}  // namespace dyop
