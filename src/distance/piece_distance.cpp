#include "distance/piece_distance.h"

#include "distance/gjk/triangle_core.h"
#include "dyop/core/tolerance.h"
#include "dyop/distance/gjk.h"
#include "dyop/distance/triangle_distance.h"

namespace dyop::internal {
namespace {

// Local vertex numbers 0, 1, 2 of a triangle to those of its mesh.
Feature mesh_feature(Feature local, const TriangleIndices& indices) {
  for (std::int32_t& vertex : local.vertices) {
    if (vertex >= 0) vertex = indices[static_cast<std::size_t>(vertex)];
  }
  return local;
}

Feature piece_feature(const Feature& feature, const LeafPiece& piece) {
  return piece.mesh ? mesh_feature(feature, piece.indices()) : feature;
}

PieceDistance triangle_pieces(const Triangle& a, const Triangle& b, const RigidPose& X_AB) {
  const TriangleDistance kernel = triangle_distance(a, {X_AB * b[0], X_AB * b[1], X_AB * b[2]});
  PieceDistance result;
  result.lower = kernel.lower;
  result.upper = kernel.upper;
  result.p_ACa = kernel.p_a;
  result.p_ACb = kernel.p_b;
  result.nhat_AB_A = kernel.normal;
  result.feature_a = kernel.feature_a;
  result.feature_b = kernel.feature_b;
  result.is_overlapping = kernel.is_crossing;
  return result;
}

PieceDistance convex_pieces(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB,
                            const GjkGoal& goal, GjkSeed& seed) {
  const GjkResult gjk = gjk_distance(a, b, X_AB, goal, seed);
  PieceDistance result;
  result.lower = gjk.lower;
  result.upper = gjk.upper;
  result.p_ACa = gjk.p_ACa;
  result.p_ACb = gjk.p_ACb;
  result.nhat_AB_A = gjk.nhat_AB_A;
  result.feature_a = gjk.feature_a;
  result.feature_b = gjk.feature_b;
  result.is_overlapping = gjk.is_overlapping;
  result.gjk_iterations = gjk.iterations;
  return result;
}

PieceDistance convex_pieces(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB) {
  GjkSeed seed;
  return convex_pieces(a, b, X_AB, GjkGoal{}, seed);
}

// Points of a compound have been through one more pose.
Scalar posed_size(const Shape& shape) {
  return (shape.kind() == ShapeKind::Compound ? 2 : 1) * shape.bounding_radius();
}

// A point of B off by pose_noise changes the distance by no more.
void widen(PieceDistance& result, Scalar pose_noise) {
  result.lower = std::max(0.0, result.lower - pose_noise);
  result.upper += pose_noise;
}

}  // namespace

PieceDistance piece_distance(const ShapeTree& a, std::int32_t leaf_a, const ShapeTree& b,
                             std::int32_t leaf_b, const RigidPose& X_AB, Scalar pose_noise) {
  const LeafPiece piece_a = a.piece(leaf_a);
  const LeafPiece piece_b = b.piece(leaf_b);
  PieceDistance result;
  if (piece_a.mesh && piece_b.mesh) {
    result = triangle_pieces(piece_a.corners(), piece_b.corners(), X_AB);
  } else if (piece_a.mesh) {
    result = convex_pieces(TriangleCore(piece_a.corners()), *piece_b.convex, X_AB);
  } else if (piece_b.mesh) {
    result = convex_pieces(*piece_a.convex, TriangleCore(piece_b.corners()), X_AB);
  } else {
    result = convex_pieces(*piece_a.convex, *piece_b.convex, X_AB);
  }
  result.feature_a = piece_feature(result.feature_a, piece_a);
  result.feature_b = piece_feature(result.feature_b, piece_b);
  widen(result, pose_noise);
  return result;
}

PieceDistance piece_distance(const ShapeTree& a, std::int32_t leaf_a, const ShapeTree& b,
                             std::int32_t leaf_b, const RigidPose& X_AB, Scalar pose_noise,
                             const GjkGoal& goal, GjkSeed& seed) {
  if (!a.convex() || !b.convex()) return piece_distance(a, leaf_a, b, leaf_b, X_AB, pose_noise);
  PieceDistance result = convex_pieces(*a.convex(), *b.convex(), X_AB, goal, seed);
  widen(result, pose_noise);
  return result;
}

Scalar pose_noise(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB) {
  return kPoseNoise *
         (X_WA.translation().norm() + X_WB.translation().norm() + posed_size(a) + posed_size(b));
}

}  // namespace dyop::internal
