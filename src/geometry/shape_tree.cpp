// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/shape_tree.h"

#include <algorithm>
#include <iterator>

#include "core/tolerance.h"

namespace dyop::geometry_internal {

ShapeTree::ShapeTree(const Shape& shape, Scalar extent, ConvexBox box) {
  switch (shape.kind()) {
    case ShapeKind::TriangleMesh:
      mesh_ = static_cast<const TriangleMesh*>(&shape);
      nodes_ = mesh_->hierarchy().nodes().data();
      node_count_ = std::int32_t(mesh_->hierarchy().nodes().size());
      frame_ = mesh_->hierarchy().frame();
      return;
    case ShapeKind::Convex:
      if (const HalfSpace* half_space = as_half_space(shape)) {
        half_space_.emplace(half_space->within(extent));
        convex_ = &*half_space_;
      } else {
        convex_ = static_cast<const ConvexShape*>(&shape);
        rounding_ = convex_->rounding_radius();
      }
      set_one_leaf();
      if (box == ConvexBox::Fitted) half_space_ ? set_half_space() : set_convex();
      return;
    case ShapeKind::Compound:
      compound_ = &static_cast<const CompoundShape&>(shape).tree();
      nodes_ = compound_->nodes.data();
      node_count_ = std::int32_t(compound_->nodes.size());
      frame_ = compound_->frame;
      return;
  }
}

LeafPiece ShapeTree::compound_piece(std::int32_t leaf) const {
  const std::int32_t number = triangle(leaf);
  const std::int32_t child = compound_->child_of(number);
  const CompoundPart& part = compound_->part(child);
  if (!part.mesh) return {nullptr, part.convex.get(), 0, child};
  return {&*part.mesh, nullptr, number - part.first_piece, child};
}

// A tree of one box, around the core: the ball reaches as far beyond it along every axis.
void ShapeTree::set_convex() {
  const AlignedBox bounds = convex_->bounding_box();
  OrientedBox box;
  box.center = bounds.center();
  // Centre and half extents are rounded, so grow by more than their error.
  const Scalar noise =
      8 * kUnitRoundoff * bounds.min().cwiseAbs().cwiseMax(bounds.max().cwiseAbs()).sum();
  box.half_extents = (bounds.sizes() / 2).array() - rounding_;
  box.half_extents = box.half_extents.cwiseMax(0).array() + noise;
  set_one_box(box);
}

// Upright on the plane, so that it ends there.
void ShapeTree::set_half_space() {
  const Scalar radius = half_space_->bounding_radius();
  const Scalar offset = half_space_->offset();
  OrientedBox box;
  box.axes.col(2) = half_space_->normal();
  box.axes.col(0) = half_space_->normal().unitOrthogonal();
  box.axes.col(1) = box.axes.col(2).cross(box.axes.col(0));
  box.center = half_space_->core_center();
  box.half_extents = Vector3(radius, radius, (radius + offset) / 2).array() + kBoxNoise * radius;
  set_one_box(box);
}

void ShapeTree::set_one_box(const OrientedBox& box) {
  frame_ = BoxFrame::around(box);
  convex_node_.boxes = {};  // the wide kernels read all columns
  convex_node_.boxes.set_box(0, box, frame_);
}

void ShapeTree::set_one_leaf() {
  std::fill(std::begin(convex_node_.child), std::end(convex_node_.child), MeshHierarchy::kNothing);
  convex_node_.child[0] = -1;
  nodes_ = &convex_node_;
}

bool ShapeTree::has_leaf(std::int32_t box) const {
  if (box < 0 || box / BoxGroup::kWidth >= node_count_) return false;
  return column_of(box) < node_of(box).count() && is_leaf(box);
}

FacingBox facing_box(const OrientedBox& box, const RigidPose& X_SO) {
  FacingBox result;
  result.is_of_cores = false;
  const Vector3 center = X_SO * box.center;
  const Matrix3 axes = X_SO.rotation() * box.axes;
  for (int i = 0; i < 3; ++i) {
    result.center[i] = center[i];
    result.half_extents[i] = box.half_extents[i];
    for (int k = 0; k < 3; ++k) result.axes[k][i] = axes(i, k);
  }
  return result;
}

}  // namespace dyop::geometry_internal
