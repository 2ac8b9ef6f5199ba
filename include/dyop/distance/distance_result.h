// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string_view>

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

/// How a distance query ended. Bounds and witness points are valid in every status but NotRun.
enum class DistanceStatus {
  NotRun,
  Separated,               ///< lower > 0: proven apart
  Overlapping,             ///< the shapes touch or intersect, up to rounding: lower = 0
  FartherThanMaxDistance,  ///< stopped early: lower > max_distance is proven; upper and witness
                           ///< may be infinite
  Inconclusive,            ///< lower = 0 < upper, and neither separation nor overlap was proven
};

/// The enumerator's name.
std::string_view name_of(DistanceStatus status);
std::ostream& operator<<(std::ostream& out, DistanceStatus status);

/// How far and along which direction two overlapping convex shapes must move apart.
struct Penetration {
  Scalar depth = 0;                      ///< length, > 0
  Vector3 nhat_AB_W = Vector3::UnitX();  ///< moving B by depth along it separates the shapes
  Vector3 p_W = Vector3::Zero();         ///< a point in the overlap
};

struct DistanceStatistics {
  std::int64_t box_tests = 0;   ///< pairs of bounding boxes
  std::int64_t leaf_tests = 0;  ///< pairs of triangles or convex pieces
  std::int64_t gjk_iterations = 0;
};

/// Result of distance(), for A and B the first and the second shape.
struct DistanceResult : WitnessPair {
  DistanceStatus status = DistanceStatus::NotRun;
  std::optional<Penetration> penetration;  ///< if asked for, convex pairs, status Overlapping
  DistanceStatistics statistics;
};

/// Status and bounds, on one line.
std::ostream& operator<<(std::ostream& out, const DistanceResult& result);

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
