// SPDX-License-Identifier: BSD-3-Clause
#include "distance/pivot_seed.h"

#include "geometry/shape_tree.h"

namespace dyop::distance_internal {
namespace {

Scalar squared_distance(const OrientedBox& box, const Vector3& p) {
  const Vector3 local = box.axes.transpose() * (p - box.center);
  return (local.cwiseAbs() - box.half_extents).cwiseMax(0).squaredNorm();
}

// Boxes overlap: of those that hold the pivot the one whose middle is nearest goes first.
std::int32_t leaf_at(const ShapeTree& tree, const Vector3& p) {
  std::int32_t box = ShapeTree::kRoot;
  while (!tree.is_leaf(box)) {
    const std::int32_t node = tree.child(box);
    const int count = tree.node(node).count();
    Scalar nearest = kInfinity;
    Scalar nearest_middle = kInfinity;
    for (int column = 0; column < count; ++column) {
      const std::int32_t part = ShapeTree::box_number(node, column);
      const OrientedBox candidate = tree.box(part);
      const Scalar distance = squared_distance(candidate, p);
      const Scalar middle = (candidate.center - p).squaredNorm();
      if (distance > nearest || (distance == nearest && !(middle < nearest_middle))) continue;
      nearest = distance;
      nearest_middle = middle;
      box = part;
    }
    if (nearest == kInfinity) return ShapeTree::kRoot;  // NaN: no seed
  }
  return box;
}

}  // namespace

AlignedBox posed_box(const Shape& shape, const RigidPose& X_WS) {
  const AlignedBox box = shape.bounding_box();
  const Vector3 half = X_WS.rotation().cwiseAbs() * (box.sizes() / 2);
  const Vector3 center = X_WS * Vector3(box.center());
  return {center - half, center + half};
}

Pivot internal_box_pivot(const Shape& a, const RigidPose& X_WA, const Shape& b,
                         const RigidPose& X_WB) {
  const AlignedBox box_a = posed_box(a, X_WA);
  const AlignedBox box_b = posed_box(b, X_WB);
  Pivot pivot;
  pivot.p_W = (box_a.min().cwiseMax(box_b.min()) + box_a.max().cwiseMin(box_b.max())) / 2;
  const Vector3 between = box_b.center() - box_a.center();
  if (between.norm() > 0) pivot.nhat_AB_W = between.normalized();
  return pivot;
}

PairSeed seed_at(const Pivot& pivot, const Shape& a, const RigidPose& X_WA, const Shape& b,
                 const RigidPose& X_WB) {
  if (a.kind() == ShapeKind::Convex && b.kind() == ShapeKind::Convex) return {};
  PairSeed seed;
  seed.pieces.nearest = {leaf_at(ShapeTree(a), X_WA.inverse() * pivot.p_W),
                         leaf_at(ShapeTree(b), X_WB.inverse() * pivot.p_W)};
  return seed;
}

}  // namespace dyop::distance_internal
