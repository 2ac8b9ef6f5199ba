// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <tuple>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "support/inputs/mesh_generators.h"

namespace dyop::testing {

/// A box from the origin to `size` whose faces are divided into rectangles, two triangles each;
/// every vertex once. Closed.
/// @param cells Along each axis.
inline MeshArrays divided_box(const Vector3& size, const Eigen::Vector3i& cells,
                              const RigidPose& X = RigidPose()) {
  MeshArrays mesh;
  std::map<std::tuple<int, int, int>, std::int32_t> numbers;
  const auto vertex = [&](const Eigen::Vector3i& place) {
    const auto [found, is_new] = numbers.try_emplace(std::tuple(place.x(), place.y(), place.z()),
                                                     std::int32_t(mesh.vertices.size()));
    if (is_new) {
      const Vector3 share = place.cast<Scalar>().cwiseQuotient(cells.cast<Scalar>());
      mesh.vertices.push_back(X * Vector3(size.cwiseProduct(share)));
    }
    return found->second;
  };
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const int end : {0, cells[axis]}) {
      for (int i = 0; i < cells[u]; ++i) {
        for (int k = 0; k < cells[v]; ++k) {
          const auto corner = [&](int along, int across) {
            Eigen::Vector3i place;
            place[axis] = end;
            place[u] = i + along;
            place[v] = k + across;
            return vertex(place);
          };
          const std::int32_t a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
          if (end == 0) {
            mesh.triangles.push_back({a, c, b});
            mesh.triangles.push_back({a, d, c});
          } else {
            mesh.triangles.push_back({a, b, c});
            mesh.triangles.push_back({a, c, d});
          }
        }
      }
    }
  }
  return mesh;
}

}  // namespace dyop::testing
