// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "dyop/geometry/triangle_mesh.h"

namespace dyop::geometry_internal {

// Finds farthest vertices of a convex polytope by climbing along its edges.
class HullClimber {
 public:
  // `surface` is closed and exactly convex, as quickhull() makes it.
  explicit HullClimber(const TriangleMesh& surface);

  // A vertex with no neighbor certainly or possibly farther along the direction: on a convex
  // polytope it is the farthest of all. Nothing if rounding leaves a doubt, or if the climb takes
  // more work than a scan of all vertices.
  std::optional<std::int32_t> find(const Vector3& direction) const;

 private:
  std::int32_t best_start(const Vector3& direction) const;

  TriangleMesh surface_;
  std::vector<std::int32_t> first_;  // by vertex: start of its neighbors; one more at the end
  std::vector<std::int32_t> neighbors_;
  std::vector<std::int32_t> starts_;  // the farthest vertices along spread-out directions
};

}  // namespace dyop::geometry_internal
