#pragma once

#include <cstdint>

#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/mesh_hierarchy.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop::internal {

/// One view on both kinds of shape for traversals: a tree of oriented boxes whose leaves are
/// pieces, a triangle of a mesh or a whole convex shape. Does not own the shape.
class ShapeTree {
 public:
  explicit ShapeTree(const Shape& shape);

  const OrientedBox& box(std::int32_t node) const { return mesh_ ? nodes_[node].box : convex_box_; }
  bool is_leaf(std::int32_t node) const { return mesh_ ? nodes_[node].is_leaf : true; }
  /// First of the two children of an inner node; the other is the next.
  std::int32_t first_child(std::int32_t node) const { return nodes_[node].first; }
  /// Triangle number of a leaf of a mesh.
  std::int32_t triangle(std::int32_t leaf) const { return nodes_[leaf].first; }

  const TriangleMesh* mesh() const { return mesh_; }
  const ConvexShape* convex() const { return convex_; }

 private:
  const TriangleMesh* mesh_ = nullptr;
  const MeshHierarchy::Node* nodes_ = nullptr;
  const ConvexShape* convex_ = nullptr;
  OrientedBox convex_box_;
};

}  // namespace dyop::internal
