// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "dyop/geometry/shape.h"
#include "io/robot/mesh_finder.h"

namespace dyop::io_internal {

/// A link's shapes: around what the file describes, and inside it. They are the same object unless
/// the file describes a cylinder.
struct LinkShapes {
  std::shared_ptr<const Shape> outer;  ///< null: no geometry
  std::shared_ptr<const Shape> inner;
  bool is_solid = false;  ///< every mesh is closed
};

/// Reads the elements <collision> of an element <link>.
LinkShapes read_link_shapes(const XmlNode& link, MeshFinder& meshes);

/// A prism of 64 sides about z, around a cylinder or inside it.
std::shared_ptr<const Shape> prism_around(Scalar radius, Scalar length);
std::shared_ptr<const Shape> prism_inside(Scalar radius, Scalar length);

}  // namespace dyop::io_internal
