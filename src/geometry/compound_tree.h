// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/triangle_mesh.h"
#include "geometry/posed_convex.h"

namespace dyop::geometry_internal {

/// A child of a compound in the compound's frame: a mesh or a convex shape, with its own vertex and
/// triangle numbers.
struct CompoundPart {
  std::optional<TriangleMesh> mesh;
  std::unique_ptr<const PosedConvex> convex;  // null for a mesh
  std::int32_t first_piece = 0;

  const Shape& shape() const {
    return mesh ? static_cast<const Shape&>(*mesh) : static_cast<const Shape&>(*convex);
  }
};

/// All pieces of a compound, triangles and convex shapes, under one tree in the compound's frame: a
/// small tree over the children, and below it copies of the meshes' own trees. Pieces are numbered
/// child by child.
struct CompoundTree {
  /// Children must be meshes and convex shapes.
  explicit CompoundTree(std::span<const CompoundChild> children);

  /// The number of the child that a piece belongs to.
  std::int32_t child_of(std::int32_t piece) const;
  const CompoundPart& part(std::int32_t child) const {
    return parts[static_cast<std::size_t>(child)];
  }

  std::vector<CompoundPart> parts;
  std::vector<MeshHierarchy::Node> nodes;
  Scalar scale = 1;
};

}  // namespace dyop::geometry_internal
