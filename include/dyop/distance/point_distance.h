// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "dyop/core/batch_options.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/shape.h"

namespace DYOP_EXPORT dyop {

struct PointDistanceOptions {
  /// Stop as soon as the surface is proven farther from the point than this; length, >= 0. `upper`
  /// is then infinite (inside, with signed distances, `lower` is -infinity), the witness unknown.
  Scalar max_distance = kInfinity;
  /// Count distances inside the shape as negative. A mesh must then be closed: inside is where it
  /// winds around the point (winding_number()). A convex shape must have a core_surface().
  bool is_signed = false;
};

/// Result of point_distance().
struct PointDistance {
  Scalar lower = 0;          ///< never above the true distance, signed if requested
  Scalar upper = kInfinity;  ///< never below it
  /// The point of the surface nearest to the given one, within rounding. If a convex shape contains
  /// the given point and distances are unsigned, that point itself.
  Vector3 p_WC = Vector3::Zero();
  /// Unit vector along which the distance grows fastest: from the surface to the point or, inside a
  /// shape with signed distances, from the point to the surface. Arbitrary where undefined, as at
  /// the centre of a sphere.
  Vector3 nhat_W = Vector3::UnitX();
  Feature feature;                       ///< of the shape (of its core if curved) at p_WC
  std::optional<std::int32_t> triangle;  ///< triangle number, if the shape (child) is a mesh
  std::optional<std::int32_t> child;     ///< number of the child, if the shape is a compound
};

/// Returns the distance of a point from a shape, with proven bounds lower <= d <= upper, and the
/// nearest point of the shape.
///
/// For a mesh d is the distance from the surface, for a convex shape from the solid, so 0 inside;
/// with PointDistanceOptions::is_signed it is negative inside, -d from the surface. upper - lower
/// is rounding noise (docs/concepts.md).
///
/// @param X_WS Pose of the shape in world.
/// @param p_W  The point in world, finite.
/// @throws InvalidArgument if p_W is not finite, max_distance is negative or NaN, or is_signed is
///         set and the shape is an open mesh, a compound, or has no core_surface().
/// Reads the shape only; thread-safe, no allocation. Method: docs/algorithms/distance.md, "Points".
PointDistance point_distance(const Shape& shape, const RigidPose& X_WS, const Vector3& p_W,
                             const PointDistanceOptions& options = {});

/// Answers many points on several threads: results[i] is bit for bit what point_distance() returns
/// for points_W[i], for any number of threads. After a stop, points that were not answered have the
/// bounds 0 and infinity.
/// @throws InvalidArgument before any point is answered if the spans differ in length, thread_count
///         is negative, or as for point_distance(); the message names the lowest such point. An
///         exception from the progress callback ends the batch as a stop does.
void point_distance_batch(const Shape& shape, const RigidPose& X_WS,
                          std::span<const Vector3> points_W, std::span<PointDistance> results,
                          const PointDistanceOptions& options = {},
                          const BatchOptions& batch_options = {});

}  // namespace dyop
