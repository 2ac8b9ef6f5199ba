// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <span>
#include <string_view>

#include "dyop/core/batch_options.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/shape.h"

namespace DYOP_EXPORT dyop {

/// A straight path of a point in world or, with a radius, of a ball.
struct Ray {
  Vector3 p_W = Vector3::Zero();           ///< where the centre starts
  Vector3 direction_W = Vector3::UnitX();  ///< of any length but zero
  Scalar length = kInfinity;               ///< how far the centre goes; >= 0
  Scalar radius = 0;                       ///< of the ball, >= 0
};

/// How a ray ended. `hit` and `distance` are members of RayHit.
enum class RayStatus {
  NotRun,
  Miss,               ///< proven: nothing is touched on the whole length
  Hit,                ///< touches the shape at `distance`, up to rounding
  InitiallyTouching,  ///< not proven apart at the start: `distance` is 0
  NumericalLimit,     ///< undecided after `distance`: the shape's numbers allow no sharper answer
};

/// The enumerator's name.
std::string_view name_of(RayStatus status);
std::ostream& operator<<(std::ostream& out, RayStatus status);

/// Result of ray_cast().
///
/// For EVERY status but NotRun the ball, centred at any point of the ray before `distance`, is
/// proven not to touch the shape: a hit is reported at the true surface or before it, and no ray
/// passes through an edge or between two triangles.
struct RayHit {
  RayStatus status = RayStatus::NotRun;
  /// How far the centre can go; Miss: the ray's length.
  Scalar distance = kInfinity;
  /// Upper bound on what is left between the ball and the shape there: rounding noise if Hit.
  Scalar gap = kInfinity;
  Vector3 p_WC = Vector3::Zero();        ///< where the shape is touched; not for Miss
  Vector3 nhat_W = Vector3::UnitX();     ///< unit normal there, from the shape to the ball's centre
  Feature feature;                       ///< of the shape at p_WC
  std::optional<std::int32_t> triangle;  ///< triangle number, if the shape (child) is a mesh
  std::optional<std::int32_t> child;     ///< number of the child, if the shape is a compound
};

/// Status and distance, on one line.
std::ostream& operator<<(std::ostream& out, const RayHit& hit);

/// Returns where a ray, or a ball on a straight path, first touches a shape.
///
/// A mesh is a surface with two sides, a convex shape a solid: a ray that starts inside one is
/// InitiallyTouching, one that starts inside a closed mesh hits it from within.
///
/// @param X_WS Pose of the shape in world.
/// @throws InvalidArgument if the start is not finite, the direction is not finite or zero, or
///         length or radius is negative or NaN, or the radius is infinite.
/// Reads the shape only; thread-safe, no allocation. Method: docs/algorithms/distance.md, "Rays".
RayHit ray_cast(const Shape& shape, const RigidPose& X_WS, const Ray& ray);

/// Casts many rays on several threads: hits[i] is bit for bit what ray_cast() returns for rays[i],
/// for any number of threads. After a stop, rays that were not cast are NotRun.
/// @throws InvalidArgument before any ray is cast if the spans differ in length, thread_count is
///         negative, or as ray_cast(); the message names the lowest such ray. An exception from the
///         progress callback ends the batch as a stop does.
void ray_cast_batch(const Shape& shape, const RigidPose& X_WS, std::span<const Ray> rays,
                    std::span<RayHit> hits, const BatchOptions& options = {});

}  // namespace dyop
