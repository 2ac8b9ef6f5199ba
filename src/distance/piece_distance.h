#pragma once

#include <cstdint>
#include <optional>

#include "distance/gjk/warm_gjk.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/distance/distance_result.h"
#include "geometry/shape_tree.h"

namespace dyop::internal {

/// Distance of two leaf pieces, everything in frame A.
struct PieceDistance {
  Scalar lower = 0;
  Scalar upper = kInfinity;
  Vector3 p_ACa = Vector3::Zero();
  Vector3 p_ACb = Vector3::Zero();
  Vector3 nhat_AB_A = Vector3::UnitX();  ///< unit; its slab gap proves lower
  Feature feature_a;                     ///< with the shape's own vertex numbers
  Feature feature_b;
  bool is_overlapping = false;
  int gjk_iterations = 0;

  Scalar middle() const { return (lower + upper) / 2; }
};

/// Certified distance of the pieces at two leaves.
/// @param pose_noise How far a point of B can be off in frame A by rounding; widens both bounds.
PieceDistance piece_distance(const ShapeTree& a, std::int32_t leaf_a, const ShapeTree& b,
                             std::int32_t leaf_b, const RigidPose& X_AB, Scalar pose_noise);

/// The same, but of two convex shapes only as exact as `goal` asks, and from the points of `seed`.
PieceDistance piece_distance(const ShapeTree& a, std::int32_t leaf_a, const ShapeTree& b,
                             std::int32_t leaf_b, const RigidPose& X_AB, Scalar pose_noise,
                             const GjkGoal& goal, GjkSeed& seed);

/// The triangle number at a leaf, or nothing for a convex shape.
inline std::optional<std::int32_t> triangle_number(const LeafPiece& piece) {
  if (!piece.mesh) return std::nullopt;
  return piece.triangle;
}

/// Names the pieces at two leaves in a result.
template <typename Result>
void name_pieces(const ShapeTree& a, std::int32_t leaf_a, const ShapeTree& b, std::int32_t leaf_b,
                 Result& result) {
  const LeafPiece piece_a = a.piece(leaf_a);
  const LeafPiece piece_b = b.piece(leaf_b);
  result.triangle_a = triangle_number(piece_a);
  result.triangle_b = triangle_number(piece_b);
  result.child_a = piece_a.child;
  result.child_b = piece_b.child;
}

/// Rounding allowance for comparing points of two posed shapes (kPoseNoise has the reason).
Scalar pose_noise(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB);

}  // namespace dyop::internal
