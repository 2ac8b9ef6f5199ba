#pragma once

#include <cstdint>
#include <optional>

#include "dyop/core/types.h"
#include "dyop/geometry/shape.h"

namespace dyop {

/// What a distance query found out. Bounds and witness points are valid in every status but NotRun.
enum class DistanceStatus {
  NotRun,
  Separated,         ///< lower > 0: proven apart
  Overlapping,       ///< the shapes touch or intersect, up to rounding: lower = 0
  FartherThanLimit,  ///< stopped early: lower > upper_limit is proven; upper and witness may be
                     ///< infinite
  Inconclusive,      ///< lower = 0 < upper, and neither separation nor overlap was proven
};

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

/// Result of distance(). World frame W; A and B are the first and the second shape.
struct DistanceResult {
  DistanceStatus status = DistanceStatus::NotRun;
  Scalar lower = 0;                      ///< never above the true distance
  Scalar upper = kInfinity;              ///< never below the true distance
  Vector3 p_WCa = Vector3::Zero();       ///< witness point on A
  Vector3 p_WCb = Vector3::Zero();       ///< witness point on B
  Vector3 nhat_AB_W = Vector3::UnitX();  ///< unit normal from A to B
  Feature feature_a;
  Feature feature_b;
  std::optional<std::int32_t> triangle_a;  ///< triangle number, if A is a mesh
  std::optional<std::int32_t> triangle_b;  ///< triangle number, if B is a mesh
  std::optional<std::int32_t> child_a;  ///< number of the child that was met, if A is a compound
  std::optional<std::int32_t> child_b;  ///< number of the child that was met, if B is a compound
  Vector3 pivot_W = Vector3::Zero();       ///< dynamic pivot point: middle of the witness segment
  std::optional<Penetration> penetration;  ///< if asked for, convex pairs, status Overlapping
  DistanceStatistics statistics;
};

}  // namespace dyop
