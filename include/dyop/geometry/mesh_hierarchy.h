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

/// Binary tree of oriented boxes over triangles, one triangle a leaf. Each box contains all its
/// triangles, rounding included (half extents are rounded up).
class MeshHierarchy {
 public:
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
