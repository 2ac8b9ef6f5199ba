#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dyop/geometry/triangle.h"

namespace dyop {

/// A box with its own axes. Contains {center + axes * x : |x_i| <= half_extents_i}.
struct OrientedBox {
  Vector3 center = Vector3::Zero();
  Matrix3 axes = Matrix3::Identity();  ///< columns: unit axes of the box in the shape's frame
  Vector3 half_extents = Vector3::Zero();
};

/// Binary tree of oriented boxes over triangles, one triangle a leaf, in depth-first order. Each
/// box contains all its triangles: exactly, and also when the corners center + axes * x are
/// evaluated in double, because half extents are rounded up by kBoxNoise (|center| +
/// |half_extents|).
///
/// An inner box is the smaller (by area) of the box along the principal axes of its vertices and
/// the axis-aligned one; a leaf's is aligned with the triangle's longest edge and normal. Nodes are
/// split by a binned surface-area heuristic [Wald2007]. The same input gives the same tree.
class MeshHierarchy {
 public:
  /// No node is deeper (the root has depth 0): enough for a traversal's stack of fixed size.
  static constexpr int kMaxDepth = 96;

  struct Node {
    OrientedBox box;
    std::int32_t first = -1;  ///< inner: the children are nodes first and first + 1; leaf: triangle
    bool is_leaf = false;
  };

  /// Triangles may be degenerate; at least one.
  MeshHierarchy(std::span<const Vector3> vertices, std::span<const TriangleIndices> triangles);

  /// Node 0 is the root.
  const std::vector<Node>& nodes() const { return nodes_; }

 private:
  std::vector<Node> nodes_;
};

}  // namespace dyop
