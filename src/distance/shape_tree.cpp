#include "distance/shape_tree.h"

#include "dyop/core/tolerance.h"

namespace dyop::internal {

ShapeTree::ShapeTree(const Shape& shape) {
  if (shape.kind() == ShapeKind::TriangleMesh) {
    mesh_ = static_cast<const TriangleMesh*>(&shape);
    nodes_ = mesh_->hierarchy().nodes().data();
    return;
  }
  convex_ = static_cast<const ConvexShape*>(&shape);
  const AlignedBox bounds = shape.bounding_box();
  convex_box_.center = bounds.center();
  // Centre and half extents are rounded: grow by more than their error.
  const Scalar noise =
      8 * kUnitRoundoff * bounds.min().cwiseAbs().cwiseMax(bounds.max().cwiseAbs()).sum();
  convex_box_.half_extents = (bounds.sizes() / 2).array() + noise;
}

}  // namespace dyop::internal
