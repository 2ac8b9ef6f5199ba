// SPDX-License-Identifier: BSD-3-Clause
#include "distance/piece_distance.h"

#include <cmath>
#include <utility>

#include "core/assert.h"
#include "core/tolerance.h"
#include "distance/core_distance.h"
#include "distance/gjk/triangle_core.h"
#include "dyop/distance/gjk.h"
#include "dyop/distance/triangle_distance.h"

namespace dyop::distance_internal {
namespace {

Feature piece_feature(const Feature& feature, const LeafPiece& piece) {
  return piece.mesh ? mesh_feature(feature, piece.indices()) : feature;
}

PieceDistance triangle_pieces(const Triangle& a, const Triangle& b, const RigidPose& X_AB) {
  return {triangle_distance(a, {X_AB * b[0], X_AB * b[1], X_AB * b[2]}), 0};
}

PieceDistance convex_pieces(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB,
                            const GjkGoal& goal, GjkSeed& seed) {
  static const Matrix3 kAxes = Matrix3::Identity();
  PieceDistance piece;
  const CorePlaces places{kAxes, X_AB.rotation(), X_AB.translation(), true};
  if (core_distance(a.simple_core(), b.simple_core(), places, piece)) return piece;
  const GjkResult gjk = gjk_distance(a, b, X_AB, goal, seed);
  return {gjk, gjk.iterations};
}

PieceDistance convex_pieces(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB) {
  GjkSeed seed;
  return convex_pieces(a, b, X_AB, GjkGoal{}, seed);
}

PieceDistance turned(PieceDistance piece) {
  std::swap(piece.p_a, piece.p_b);
  std::swap(piece.feature_a, piece.feature_b);
  piece.nhat_AB = -piece.nhat_AB;
  return piece;
}

PieceDistance triangle_and_convex(const Triangle& a, const ConvexShape& b, const RigidPose& X_AB) {
  PieceDistance piece;
  if (triangle_core_distance(a, b.simple_core(), X_AB, piece)) return piece;
  return convex_pieces(TriangleCore(a), b, X_AB);
}

// In frame A, as all answers: the triangle is brought there.
PieceDistance convex_and_triangle(const ConvexShape& a, const Triangle& b, const RigidPose& X_AB) {
  PieceDistance piece;
  const Triangle b_A{X_AB * b[0], X_AB * b[1], X_AB * b[2]};
  if (triangle_core_distance(b_A, a.simple_core(), RigidPose(), piece)) return turned(piece);
  return convex_pieces(a, TriangleCore(b), X_AB);
}

// Points of a compound were transformed by one more pose.
Scalar posed_size(const Shape& shape) {
  // What matters is where the other shape is.
  if (const HalfSpace* half_space = as_half_space(shape)) return std::abs(half_space->offset());
  return (shape.kind() == ShapeKind::Compound ? 2 : 1) * shape.bounding_radius();
}

// An error of pose_noise in a point of B changes the distance by no more than that.
void widen(PieceDistance& result, Scalar pose_noise) {
  DYOP_ASSERT(result.lower <= result.upper, result.lower, ' ', result.upper);
  DYOP_ASSERT(std::abs(result.nhat_AB.squaredNorm() - 1) <= 2 * kRotationTolerance, result.nhat_AB);
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
    result = triangle_and_convex(piece_a.corners(), *piece_b.convex, X_AB);
  } else if (piece_b.mesh) {
    result = convex_and_triangle(*piece_a.convex, piece_b.corners(), X_AB);
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

Feature mesh_feature(Feature local, const TriangleIndices& indices) {
  for (std::size_t k = 0; k < local.vertex_count(); ++k) {
    local.vertices[k] = indices[static_cast<std::size_t>(local.vertices[k])];
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
  const LeafPiece piece_a = a.piece(leaf_a);
  const LeafPiece piece_b = b.piece(leaf_b);
  pair.triangle_a = triangle_number(piece_a);
  pair.triangle_b = triangle_number(piece_b);
  pair.child_a = piece_a.child;
  pair.child_b = piece_b.child;
  return pair;
}

Scalar pose_noise(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB) {
  return kPoseNoise * (length_for_noise(X_WA.translation()) + length_for_noise(X_WB.translation()) +
                       posed_size(a) + posed_size(b));
}

}  // namespace dyop::distance_internal
