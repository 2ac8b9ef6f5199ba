// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "dyop/hierarchy/mesh_hierarchy.h"

namespace dyop::hierarchy_internal {

/// The box of a triangle, aligned with its longest edge and normal. Contains it as kBoxNoise says.
OrientedBox fit_triangle(const Triangle& triangle);

/// The smaller (by area) of the box along the principal axes of the vertices and the axis-aligned
/// one. At least one triangle. Contains them as kBoxNoise says, also if products of coordinates
/// under- or overflow.
OrientedBox fit_triangles(std::span<const Triangle> triangles);

/// About the size of that box, without its rounding: from a sample of many triangles.
Vector3 fitted_size(std::span<const Triangle> triangles);

// The unit direction from a to b along which the slabs of the two boxes are farthest apart, among
// the fifteen axes of the separating axis test, the line of centers [Gottschalk1996], and the
// vector between the faces of a that face b, which is exact for boxes with the same axes. Some unit
// vector if none separates. Only proposes: a caller evaluates the gap itself. Both boxes are in one
// frame.
//
// Not find_axis() of box_axis.h: boxes of deforming sides are made for a time interval, in double
// precision, and are not columns of a node. Filling a group for one pair costs more than testing
// the axes, single precision loses the exact direction of aligned boxes, and here a direction that
// does not separate is dropped early.
Vector3 separating_direction(const OrientedBox& a, const OrientedBox& b);

/// A node of the binary tree that is collapsed into a MeshHierarchy. Nodes come in preorder: the
/// left child of node n is n + 1.
struct SplitNode {
  /// The right child, or -1 - triangle for a leaf.
  std::int32_t right = -1;
  /// By k: how many of k columns of a wide node given to this node go to its left child; 0 if its
  /// box is a single column.
  std::array<std::int8_t, MeshHierarchy::kWidth + 1> left_columns{};

  bool is_leaf() const { return right < 0; }
};

/// Splits triangles (at least one) by a binned surface-area heuristic [Wald2007] over axis-aligned
/// boxes in single precision until each is alone, and decides how to collapse the tree into wide
/// nodes at the least expected cost [Ylitie2017]. Boxes are rounded to nearest: they affect the
/// quality of the tree, not what its final boxes contain. No leaf is deeper than
/// MeshHierarchy::kMaxDepth. Runs on the threads of oneTBB; the result does not depend on their
/// number.
std::vector<SplitNode> build_split_tree(std::span<const Vector3> vertices,
                                        std::span<const TriangleIndices> triangles);

}  // namespace dyop::hierarchy_internal
