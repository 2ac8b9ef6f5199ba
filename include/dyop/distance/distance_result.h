// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string_view>

#include "dyop/core/types.h"
#include "dyop/distance/witness_pair.h"

namespace DYOP_EXPORT dyop {

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

}  // namespace dyop
