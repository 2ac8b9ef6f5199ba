#include "distance/piece_distance.h"

#include "distance/gjk/triangle_core.h"
#include "dyop/core/tolerance.h"
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

Scalar pose_noise(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB) {
  return kPoseNoise * (X_WA.translation().norm() + X_WB.translation().norm() + a.bounding_radius() +
                       b.bounding_radius());
}

}  // namespace dyop::internal
