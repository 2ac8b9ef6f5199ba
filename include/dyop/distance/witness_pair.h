// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "dyop/core/types.h"
#include "dyop/geometry/shape.h"

namespace DYOP_EXPORT dyop {

/// Two witness points of bodies A and B in world W, with bounds on their features' distance d:
/// lower <= d <= upper.
struct WitnessPair {
  Scalar lower = 0;                      ///< never above d
  Scalar upper = kInfinity;              ///< never below d
  Vector3 p_WCa = Vector3::Zero();       ///< witness point on A
  Vector3 p_WCb = Vector3::Zero();       ///< witness point on B
  Vector3 nhat_AB_W = Vector3::UnitX();  ///< unit normal from A to B
  Feature feature_a;                     ///< with the shape's own vertex numbers
  Feature feature_b;
  std::optional<std::int32_t> triangle_a;  ///< triangle number, if A, or its child, is a mesh
  std::optional<std::int32_t> triangle_b;  ///< triangle number, if B, or its child, is a mesh
  std::optional<std::int32_t> child_a;     ///< if A is a compound: the child that was met;
  std::optional<std::int32_t> child_b;     ///< feature and triangle use that child's numbers

  /// Dynamic pivot point: the midpoint of the witness segment.
  Vector3 pivot_W() const { return (p_WCa + p_WCb) / 2; }
};

/// One pair of features in, or near, contact.
using Contact = WitnessPair;

}  // namespace dyop
