#include "distance/piece_distance.h"

#include "core/tolerance.h"
#include "distance/gjk/triangle_core.h"
#include "dyop/distance/gjk.h"
#include "dyop/distance/triangle_distance.h"

namespace dyop::internal {
namespace {

Feature piece_feature(const Feature& feature, const ShapeTree& tree, std::int32_t leaf) {
  if (!tree.mesh()) return feature;
  return mesh_feature(feature,
                      tree.mesh()->triangles()[static_cast<std::size_t>(tree.triangle(leaf))]);
}

PieceDistance triangle_pieces(const Triangle& a, const Triangle& b, const RigidPose& X_AB) {
  return {triangle_distance(a, {X_AB * b[0], X_AB * b[1], X_AB * b[2]}), 0};
}

PieceDistance convex_pieces(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB,
                            const GjkGoal& goal, GjkSeed& seed) {
  const GjkResult gjk = gjk_distance(a, b, X_AB, goal, seed);
  return {gjk, gjk.iterations};
}

PieceDistance convex_pieces(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB) {
  GjkSeed seed;
  return convex_pieces(a, b, X_AB, GjkGoal{}, seed);
}

// A point of B off by pose_noise changes the distance by no more.
void widen(PieceDistance& result, Scalar pose_noise) {
  result.lower = std::max(0.0, result.lower - pose_noise);
  result.upper += pose_noise;
}

}  // namespace

PieceDistance piece_distance(const ShapeTree& a, std::int32_t leaf_a, const ShapeTree& b,
                             std::int32_t leaf_b, const RigidPose& X_AB, Scalar pose_noise) {
  PieceDistance result;
  if (a.mesh() && b.mesh()) {
    result = triangle_pieces(a.mesh()->triangle(a.triangle(leaf_a)),
                             b.mesh()->triangle(b.triangle(leaf_b)), X_AB);
  } else if (a.mesh()) {
    result = convex_pieces(TriangleCore(a.mesh()->triangle(a.triangle(leaf_a))), *b.convex(), X_AB);
  } else if (b.mesh()) {
    result = convex_pieces(*a.convex(), TriangleCore(b.mesh()->triangle(b.triangle(leaf_b))), X_AB);
  } else {
    result = convex_pieces(*a.convex(), *b.convex(), X_AB);
  }
  result.feature_a = piece_feature(result.feature_a, a, leaf_a);
  result.feature_b = piece_feature(result.feature_b, b, leaf_b);
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

Feature mesh_feature(Feature local, const TriangleIndices& indices) {
  for (std::int32_t& vertex : local.vertices) {
    if (vertex >= 0) vertex = indices[static_cast<std::size_t>(vertex)];
  }
  return local;
}

WitnessPair witness_pair(const PieceDistance& piece, const ShapeTree& a, std::int32_t leaf_a,
                         const ShapeTree& b, std::int32_t leaf_b, const RigidPose& X_WA) {
  WitnessPair pair;
  pair.lower = piece.lower;
  pair.upper = piece.upper;
  pair.p_WCa = X_WA * piece.p_a;
  pair.p_WCb = X_WA * piece.p_b;
  pair.nhat_AB_W = X_WA.rotation() * piece.nhat_AB;
  pair.feature_a = piece.feature_a;
  pair.feature_b = piece.feature_b;
  pair.triangle_a = triangle_number(a, leaf_a);
  pair.triangle_b = triangle_number(b, leaf_b);
  return pair;
}

Scalar pose_noise(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB) {
  return kPoseNoise * (X_WA.translation().norm() + X_WB.translation().norm() + a.bounding_radius() +
                       b.bounding_radius());
}

}  // namespace dyop::internal
