// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "dyop/distance/distance.h"
#include "dyop/dynamics/rigid_body.h"
#include "dyop/toi/toi_result.h"

namespace DYOP_EXPORT dyop {

/// Which bodies a query of a World considers: enabled ones whose CollisionFilter::category has a
/// bit of `mask`, and whose mask has one of `category`.
struct BodyFilter {
  std::uint64_t mask = ~std::uint64_t{0};
  std::uint64_t category = ~std::uint64_t{0};
  bool includes_sensors = false;
  /// Called at most once per body and query, in no fixed order; empty: all.
  std::function<bool(BodyId)> accepts = {};
};

/// What a ray meets first. Result of World::cast_ray().
struct BodyRayHit {
  /// Impact: `body` is met. InitiallyWithinTarget: the ray begins in or at it. Separated: nothing
  /// is met on the whole ray. Others: undecided beyond `distance`, see ToiStatus.
  ToiStatus status = ToiStatus::NotRun;
  std::optional<BodyId> body;
  /// Along the ray, length: proven free up to here, at an impact no more than ToiResult's tolerance
  /// before the surface, measured across the gap.
  Scalar distance = 0;
  Vector3 p_W = Vector3::Zero();         ///< Impact: the place on the body
  Vector3 nhat_W = Vector3::Zero();      ///< Impact: its normal there, against the ray; unit
  std::optional<std::int32_t> triangle;  ///< Impact: of a mesh
};

/// What a moving shape meets first, as ObstacleImpact. Result of World::cast_shape().
struct ShapeHit {
  ToiResult toi;  ///< A is the shape, B the body
  std::optional<BodyId> body;
  Scalar free_fraction = 0;  ///< of the interval, proven free; 1 if Separated
};

/// The body nearest to a shape, as NearestObstacle. Result of World::nearest().
struct NearestBody {
  DistanceResult distance;  ///< A is the shape, B the body; infinite if there is none
  std::optional<BodyId> body;
};

/// The bodies near a shape. Result of World::overlaps().
struct BodyOverlaps {
  std::vector<BodyId> bodies;     ///< at most the distance away, proven; by slot
  std::vector<BodyId> undecided;  ///< so near to it that rounding does not tell; by slot
};

}  // namespace dyop
