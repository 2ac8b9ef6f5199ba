// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>

#include "dyop/core/triangle.h"
#include "dyop/geometry/mesh_topology.h"
#include "dyop/geometry/shape.h"

namespace dyop::haptics_internal {

/// The topology of a mesh whose vertices may move; the caller passes their positions.
struct SurfaceCone {
  const MeshTopology& topology;
  std::span<const TriangleIndices> triangles;

  /// Whether n . t <= sine for all unit directions t in which the surface leaves a point p of a
  /// feature of a triangle: no neighbouring piece of surface comes nearer along n than p does, as
  /// far as vertex numbers tell who is a neighbour.
  /// @param place Called with a vertex number, returns its position.
  template <typename Place>
  bool admits(const Feature& feature, std::int32_t triangle, const Vector3& n, Scalar sine,
              const Place& place) const;
};

/// Whether a direction between the rays e and f, or one of them, rises along n by more than `sine`.
bool sector_rises(const Vector3& e, const Vector3& f, const Vector3& n, Scalar sine);
/// Whether the part of `up` across `along` does.
bool side_rises(const Vector3& along, const Vector3& up, const Vector3& n, Scalar sine);

template <typename Place>
bool SurfaceCone::admits(const Feature& feature, std::int32_t triangle, const Vector3& n,
                         Scalar sine, const Place& place) const {
  switch (feature.kind) {
    case FeatureKind::Vertex: {
      const Vector3 p = place(feature.vertices[0]);
      for (const std::int32_t corner : topology.corners_of_vertex(feature.vertices[0])) {
        const TriangleIndices& t = triangles[std::size_t(corner / 3)];
        const int k = corner % 3;
        const Vector3 e = place(t[std::size_t(k < 2 ? k + 1 : 0)]) - p;
        const Vector3 f = place(t[std::size_t(k > 0 ? k - 1 : 2)]) - p;
        if (sector_rises(e, f, n, sine)) return false;
      }
      return true;
    }
    case FeatureKind::Edge: {
      const TriangleIndices& own = triangles[std::size_t(triangle)];
      for (int k = 0; k < 3; ++k) {
        const std::int32_t from = own[std::size_t(k)];
        const std::int32_t to = own[std::size_t(k < 2 ? k + 1 : 0)];
        const bool is_this = (from == feature.vertices[0] && to == feature.vertices[1]) ||
                             (from == feature.vertices[1] && to == feature.vertices[0]);
        const auto edge =
            is_this ? topology.edge_of_side(3 * triangle + k) : std::optional<std::int32_t>();
        if (!edge) continue;
        const Vector3 p = place(from);
        const Vector3 along = place(to) - p;
        for (const std::int32_t side : topology.sides_of_edge(*edge)) {
          const TriangleIndices& t = triangles[std::size_t(side / 3)];
          const int corner = side % 3;
          const Vector3 up = place(t[std::size_t(corner > 0 ? corner - 1 : 2)]) - p;
          if (side_rises(along, up, n, sine)) return false;
        }
        return true;
      }
      return true;
    }
    case FeatureKind::Face:
    case FeatureKind::Smooth:
      break;
  }
  return true;
}

}  // namespace dyop::haptics_internal
