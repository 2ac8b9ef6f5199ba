// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "dyop/hierarchy/mesh_hierarchy.h"

namespace dyop::hierarchy_internal {

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
