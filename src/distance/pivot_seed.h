// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "distance/gjk/warm_gjk.h"
#include "dyop/core/export.h"
#include "dyop/distance/distance.h"

namespace dyop::distance_internal {

/// The dynamic pivot point of two bodies and the direction through it, from A to B, in world.
struct Pivot {
  Vector3 p_W = Vector3::Zero();
  Vector3 nhat_AB_W = Vector3::UnitX();
};

/// The box in world that holds a posed shape.
DYOP_EXPORT AlignedBox posed_box(const Shape& shape, const RigidPose& X_WS);

/// The pivot of two bodies far apart: the middle of the internal box between the facing sides of
/// their boxes, and the direction between the boxes' middles.
DYOP_EXPORT Pivot internal_box_pivot(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                     const RigidPose& X_WB);

/// What the queries of two shapes begin with. Belongs to these two: unlike a DistanceCache it must
/// not be used for others.
struct PairSeed {
  DistanceCache pieces;  ///< meshes, compounds: the pieces at the pivot
  GjkSeed supports;      ///< two convex shapes: the points that spanned their nearest points
};

/// The pieces that the pivot picks: at each level of a tree the box nearest to it. Empty for two
/// convex shapes, whose queries begin along the line between their middles anyway.
DYOP_EXPORT PairSeed seed_at(const Pivot& pivot, const Shape& a, const RigidPose& X_WA,
                             const Shape& b, const RigidPose& X_WB);

/// distance() that begins with `seed` and leaves there what the next query is to begin with. Two
/// convex shapes are measured only until they are proven farther apart than max_distance; features
/// are then missing.
DYOP_EXPORT DistanceResult seeded_distance(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                           const RigidPose& X_WB, const DistanceOptions& options,
                                           PairSeed& seed);

/// The same of two shapes that are not both convex, among these pairs of boxes, the farthest first,
/// whose gaps are proven; all others must be farther apart than max_distance.
DYOP_EXPORT DistanceResult listed_distance(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                           const RigidPose& X_WB, const DistanceOptions& options,
                                           std::span<const DistanceCache::BoxPair> pairs,
                                           PairSeed& seed);

}  // namespace dyop::distance_internal
