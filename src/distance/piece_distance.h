// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "distance/gjk/warm_gjk.h"
#include "dyop/core/export.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/distance/distance_result.h"
#include "geometry/shape_tree.h"

namespace dyop::distance_internal {

/// Distance of two leaf pieces, in frame A; features with the shape's own vertex numbers.
struct PieceDistance : NearestPoints {
  int gjk_iterations = 0;

  Scalar middle() const { return (lower + upper) / 2; }
};

/// Certified distance of the pieces at two leaves.
/// @param pose_noise How far a point of B can be off in frame A by rounding; widens both bounds.
DYOP_EXPORT PieceDistance piece_distance(const ShapeTree& a, std::int32_t leaf_a,
                                         const ShapeTree& b, std::int32_t leaf_b,
                                         const RigidPose& X_AB, Scalar pose_noise);

/// The same, but two convex shapes are solved only as exactly as `goal` asks, starting at `seed`.
DYOP_EXPORT PieceDistance piece_distance(const ShapeTree& a, std::int32_t leaf_a,
                                         const ShapeTree& b, std::int32_t leaf_b,
                                         const RigidPose& X_AB, Scalar pose_noise,
                                         const GjkGoal& goal, GjkSeed& seed);

/// The triangle number at a leaf, or nothing for a convex shape.
inline std::optional<std::int32_t> triangle_number(const LeafPiece& piece) {
  if (!piece.mesh) return std::nullopt;
  return piece.triangle;
}

/// A feature of a triangle with the mesh's vertex numbers in place of local ones.
Feature mesh_feature(Feature local, const TriangleIndices& indices);

/// The nearest points of two pieces, in world.
WitnessPair witness_pair(const PieceDistance& piece, const ShapeTree& a, std::int32_t leaf_a,
                         const ShapeTree& b, std::int32_t leaf_b, const RigidPose& X_WA);

/// Allowance for rounding when points of two posed shapes are compared (see kPoseNoise).
DYOP_EXPORT Scalar pose_noise(const Shape& a, const RigidPose& X_WA, const Shape& b,
                              const RigidPose& X_WB);

}  // namespace dyop::distance_internal
