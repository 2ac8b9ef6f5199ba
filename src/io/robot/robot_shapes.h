// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "dyop/geometry/shape.h"
#include "io/robot/mesh_finder.h"

namespace dyop::io_internal {

/// A link's shape, all of its collision shapes as one.
struct LinkShape {
  std::shared_ptr<const Shape> shape;  ///< null: no geometry
  bool is_solid = false;               ///< every mesh is closed
};

/// Reads the elements <collision> of an element <link>.
LinkShape read_link_shape(const XmlNode& link, MeshFinder& meshes);

}  // namespace dyop::io_internal
