// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "dyop/core/types.h"

namespace DYOP_EXPORT dyop {

/// A box with its own axes. Contains {center + axes * x : |x_i| <= half_extents_i}.
struct OrientedBox {
  Vector3 center = Vector3::Zero();
  Matrix3 axes = Matrix3::Identity();  ///< columns: axes of the box in the shape's frame
  Vector3 half_extents = Vector3::Zero();
};

/// What the numbers of boxes in single precision are measured from, and in.
struct BoxFrame {
  Vector3 origin = Vector3::Zero();  ///< zero unless the boxes are far from it for their size
  Scalar scale = 1;                  ///< unit of length, a power of two

  /// For boxes that lie in `root`.
  static BoxFrame around(const OrientedBox& root);
  /// Raises the scale for boxes that lie in `root`, if need be.
  void make_room(const OrientedBox& root);

  Vector3 local(const Vector3& p) const { return (p - origin) / scale; }
};

/// Up to eight oriented boxes side by side in single precision, laid out for SIMD.
struct alignas(32) BoxGroup {
  static constexpr int kWidth = 8;
  /// Rows of a group: three of centers, three for each of the three axes, three of half extents.
  static constexpr int kCenter = 0;
  static constexpr int kAxes = 3;
  static constexpr int kHalfExtents = 12;
  static constexpr int kRows = 15;

  /// rows[kCenter + i], rows[kAxes + 3 * k + i] (coordinate i of axis k), rows[kHalfExtents + k];
  /// one column per box. Centers and half extents are those in a BoxFrame that is stored elsewhere.
  /// Unused columns repeat the last box, so that they hold valid numbers.
  float rows[kRows][kWidth];

  /// The box in a column: exactly, but for the rounding of the center if the origin is not zero.
  OrientedBox box(int column, const BoxFrame& frame) const;

  /// Stores a box that contains `box`, whose axes must be orthonormal to 8u: the half extents are
  /// enlarged to cover the rounding to single precision.
  /// @param frame Its scale must be at least as large as all half extents, and all coordinates of
  /// centers from its origin.
  void set_box(int column, const OrientedBox& box, const BoxFrame& frame);

  /// Half diagonal, squared, in units of the scale.
  float squared_half_diagonal(int column) const;
};

/// Tree of oriented boxes over triangles, in depth-first order, with up to eight children per node
/// and one triangle per leaf. Each box contains all its triangles: exactly, and also when the
/// corners center + axes * x are evaluated in double.
///
/// An inner box is the smaller (by area) of the box along the principal axes of its vertices and
/// the axis-aligned one; a leaf's is aligned with the triangle's longest edge and normal. A binary
/// tree is split by a binned surface-area heuristic [Wald2007] and then collapsed into wide nodes
/// at the least expected cost [Ylitie2017]. Built on the threads of oneTBB; the same input gives
/// the same tree on any number of them. Axes are orthonormal to single precision only.
class MeshHierarchy {
 public:
  static constexpr int kWidth = BoxGroup::kWidth;
  /// Upper limit on the depth of a node (the root has depth 0).
  static constexpr int kMaxDepth = 96;
  static constexpr std::int32_t kNothing = std::numeric_limits<std::int32_t>::min();

  /// 512 bytes: eight cache lines.
  struct alignas(64) Node {
    BoxGroup boxes;
    /// What each box holds: the number of a child node, -1 - triangle for a leaf, or kNothing.
    /// Every node uses at least two boxes, the first at least one; unused ones come last.
    std::int32_t child[kWidth];

    /// Boxes in use.
    int count() const {
      int count = 1;
      while (count < kWidth && child[count] != kNothing) ++count;
      return count;
    }
  };

  /// Triangles may be degenerate; at least one.
  MeshHierarchy(std::span<const Vector3> vertices, std::span<const TriangleIndices> triangles);

  /// The tree of the same triangles with other vertices: the same nodes with refitted boxes, with
  /// the same guarantee of containment. The indices must be those the tree was built from. Queries
  /// are as fast as before while nearby triangles stay near each other.
  MeshHierarchy refitted(std::span<const Vector3> vertices,
                         std::span<const TriangleIndices> triangles) const;

  /// Node 0 holds one box, the one of the whole mesh.
  const std::vector<Node>& nodes() const { return nodes_; }

  /// Of the centers and half extents in the nodes.
  const BoxFrame& frame() const { return frame_; }

 private:
  void fit_boxes(std::span<const Vector3> vertices, std::span<const TriangleIndices> triangles);

  std::vector<Node> nodes_;
  BoxFrame frame_;
};

}  // namespace dyop
