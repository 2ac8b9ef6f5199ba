// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/separating_directions.h"

#include <algorithm>
#include <cmath>

#include "distance/piece_distance.h"

namespace dyop::dynamics_internal {
namespace {

// The largest n . p over a piece, in its shape's frame.
Scalar reach_along(const LeafPiece& piece, const Vector3& n) {
  if (piece.convex) return piece.convex->core_reach(n) + piece.convex->rounding_radius();
  const Triangle t = piece.corners();
  return std::max({n.dot(t[0]), n.dot(t[1]), n.dot(t[2])});
}

// The largest distance of a piece's points from p, in its shape's frame, or more.
Scalar farthest_from(const LeafPiece& piece, const Vector3& p) {
  if (piece.convex) return p.norm() + piece.convex->bounding_radius();
  const Triangle t = piece.corners();
  return std::sqrt(
      std::max({(t[0] - p).squaredNorm(), (t[1] - p).squaredNorm(), (t[2] - p).squaredNorm()}));
}

// A bound on the gap of two pieces over a motion, along a normal n fixed to the shape S of `fixed`,
// that points to the other one.
Scalar least_gap(const LeafPiece& fixed, const LeafPiece& other, const Vector3& n,
                 const RigidPose& X_SO_begin, const RigidPose& X_SO_end,
                 const ChordMotion::Side& side) {
  const auto height = [&](const RigidPose& X_SO) {
    return n.dot(X_SO.translation()) - reach_along(other, -(X_SO.rotation().transpose() * n));
  };
  const Scalar gap = std::min(height(X_SO_begin), height(X_SO_end)) - reach_along(fixed, n);
  if (side.bend_slope == 0) return gap - side.bend;
  const Vector3 center_O = X_SO_begin.inverse() * side.center;
  return gap - side.bend - side.bend_slope * farthest_from(other, center_O);
}

}  // namespace

void SeparatingDirections::keep_unproven(const Shape& a, const Shape& b, const ChordMotion& motion,
                                         Scalar least, Scalar noise, BoxPairStack& pairs) {
  // In between the shapes are farther apart by less than a gap that proves them apart.
  const Scalar apart =
      2 * std::max(motion.X_AB_begin.translation().norm(), motion.X_AB_end.translation().norm());
  const ShapeTree tree_a(a, 2 * geometry_internal::extent_beside(a, b, apart));
  const ShapeTree tree_b(b, 2 * geometry_internal::extent_beside(b, a, apart));
  const RigidPose X_BA_begin = motion.X_AB_begin.inverse();
  const RigidPose X_BA_end = motion.X_AB_end.inverse();
  // NaN proves nothing.
  const auto is_proven = [&](const Direction& direction) {
    const LeafPiece piece_a = tree_a.piece(direction.a);
    const LeafPiece piece_b = tree_b.piece(direction.b);
    const Scalar gap = direction.is_of_b ? least_gap(piece_b, piece_a, -direction.normal,
                                                     X_BA_begin, X_BA_end, motion.b)
                                         : least_gap(piece_a, piece_b, direction.normal,
                                                     motion.X_AB_begin, motion.X_AB_end, motion.a);
    return gap > least;
  };
  const auto find_slab = [&](Direction& direction) {
    const PieceDistance piece =
        piece_distance(tree_a, direction.a, tree_b, direction.b, motion.X_AB_middle, noise);
    const auto has_face = [](const Shape& shape, const Feature& feature) {
      return feature.kind == FeatureKind::Face || as_half_space(shape);
    };
    const bool has_face_a = has_face(a, piece.feature_a);
    const bool has_face_b = has_face(b, piece.feature_b);
    direction.is_of_b = has_face_a == has_face_b ? motion.b.bend < motion.a.bend : has_face_b;
    const Vector3 normal = piece.nhat_AB.normalized();
    direction.normal =
        direction.is_of_b ? Vector3(motion.X_AB_middle.rotation().transpose() * normal) : normal;
    return piece.lower > least;
  };
  last_.swap(directions_);
  directions_.clear();
  std::size_t kept = 0;
  for (const BoxPair& pair : pairs) {
    Direction direction{pair.a, pair.b, false, Vector3::Zero()};
    const auto known = std::lower_bound(last_.begin(), last_.end(), direction);
    const bool is_known = known != last_.end() && !(direction < *known);
    if (is_known) direction = *known;
    bool is_apart = is_known && is_proven(direction);
    if (!is_apart) is_apart = find_slab(direction) && is_proven(direction);
    directions_.push_back(direction);
    if (!is_apart) pairs[kept++] = pair;
  }
  pairs.resize(kept);
  std::sort(directions_.begin(), directions_.end());
}

}  // namespace dyop::dynamics_internal
