// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "dyop/geometry/triangle_mesh.h"
#include "dyop/haptics/haptic_scene.h"

namespace dyop::haptics_internal {

/// A mesh inflated by a ball: a mesh itself, or the core of a convex shape.
struct CorePiece {
  TriangleMesh mesh;
  Scalar radius = 0;
};

/// Parts that move together: all fixed parts of the tool, or the parts on one hinge.
struct ToolBody {
  std::shared_ptr<const Shape> shape;
  std::vector<CorePiece> pieces;     ///< the same surface, for queries against deforming meshes
  std::optional<std::size_t> hinge;  ///< B is J rotated by its angle; none: B is T
  AlignedBox box;                    ///< in B
  Scalar reach = 0;                  ///< no point is farther from T's origin
  Scalar thickness = 0;              ///< least side of the box, or its diagonal if that is flat
};

/// The bodies of a tool: the fixed one first, if there are fixed parts, then by hinge.
/// @throws InvalidArgument if there is no part, a shape is missing, a hinge does not exist or has
///         no parts, or with_pieces is set and a shape has no core surface.
std::vector<ToolBody> make_tool_bodies(const HapticScene& scene, bool with_pieces);

/// No point of the tool is farther from T's origin.
Scalar reach_of(std::span<const ToolBody> bodies);

}  // namespace dyop::haptics_internal
