// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <geometric_shapes/shapes.h>
#include <octomap/octomap.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "dyop/adapters/host_geometry.h"

namespace dyop::adapters_internal {

// Scaled about the mean of the vertices, as MoveIt does.
inline std::shared_ptr<const Shape> mesh_shape(const shapes::Mesh& mesh, Scalar scale) {
  DYOP_REQUIRE(mesh.vertices != nullptr && mesh.triangles != nullptr && mesh.vertex_count > 0,
               "the mesh is empty");
  std::vector<Vector3> vertices;
  Vector3 mean = Vector3::Zero();
  for (std::size_t k = 0; k < mesh.vertex_count; ++k) {
    const double* p = mesh.vertices + 3 * k;
    vertices.emplace_back(p[0], p[1], p[2]);
    mean += vertices.back() / Scalar(mesh.vertex_count);
  }
  if (scale != 1) {
    for (Vector3& vertex : vertices) vertex = mean + scale * (vertex - mean);
  }
  std::vector<TriangleIndices> triangles;
  for (std::size_t k = 0; k < mesh.triangle_count; ++k) {
    const unsigned int* i = mesh.triangles + 3 * k;
    triangles.push_back({std::int32_t(i[0]), std::int32_t(i[1]), std::int32_t(i[2])});
  }
  return std::make_shared<TriangleMesh>(std::move(vertices), std::move(triangles));
}

}  // namespace dyop::adapters_internal

namespace dyop::adapters {

/// A shape of MoveIt as one of dyop's, scaled as MoveIt scales it: planes and octrees are not.
/// Behind a plane all is solid. Null for an octree with nothing in it.
/// @throws InvalidArgument if the shape is of an unknown kind, empty, or has a size of zero, of
///         less or NaN.
inline std::shared_ptr<const Shape> moveit_shape(const shapes::Shape& shape, Scalar scale = 1) {
  switch (shape.type) {
    case shapes::SPHERE:
      return std::make_shared<Sphere>(scale * static_cast<const shapes::Sphere&>(shape).radius);
    case shapes::BOX: {
      const double* size = static_cast<const shapes::Box&>(shape).size;
      return std::make_shared<Box>(scale / 2 * Vector3(size[0], size[1], size[2]));
    }
    case shapes::CYLINDER: {
      const auto& cylinder = static_cast<const shapes::Cylinder&>(shape);
      return std::make_shared<Cylinder>(scale * cylinder.radius, scale * cylinder.length / 2);
    }
    case shapes::CONE: {
      const auto& cone = static_cast<const shapes::Cone&>(shape);
      return std::make_shared<Cone>(scale * cone.radius, scale * cone.length / 2);
    }
    case shapes::PLANE: {
      const auto& plane = static_cast<const shapes::Plane&>(shape);
      return plane_shape(plane.a, plane.b, plane.c, plane.d);
    }
    case shapes::MESH:
      return adapters_internal::mesh_shape(static_cast<const shapes::Mesh&>(shape), scale);
    case shapes::OCTREE: {
      const auto& tree = static_cast<const shapes::OcTree&>(shape).octree;
      DYOP_REQUIRE(tree != nullptr, "the octree is missing");
      return occupied_leaves(*tree, LeafShape::Cube);
    }
    default:
      throw InvalidArgument(
          core_internal::compose_message("shapes of the type ", int(shape.type), " have no shape"));
  }
}

/// Shapes that were converted before. MoveIt never changes a shape that others may hold; shapes
/// that nobody holds any more are forgotten. Thread-safe.
class MoveitShapeCache {
 public:
  /// @throws InvalidArgument as moveit_shape(), or if there is none.
  std::shared_ptr<const Shape> get(const shapes::ShapeConstPtr& shape, Scalar scale) {
    DYOP_REQUIRE(shape != nullptr, "the shape is missing");
    {
      const std::lock_guard lock(mutex_);
      const auto known = shapes_.find(shape);
      if (known != shapes_.end()) {
        const auto scaled = known->second.find(scale);
        if (scaled != known->second.end()) return scaled->second;
      }
    }
    const std::shared_ptr<const Shape> made = moveit_shape(*shape, scale);
    const std::lock_guard lock(mutex_);
    std::erase_if(shapes_, [](const auto& entry) { return entry.first.expired(); });
    shapes_[shape].emplace(scale, made);
    return made;
  }

 private:
  using Key = std::weak_ptr<const shapes::Shape>;

  std::mutex mutex_;
  std::map<Key, std::map<Scalar, std::shared_ptr<const Shape>>, std::owner_less<Key>> shapes_;
};

}  // namespace dyop::adapters
