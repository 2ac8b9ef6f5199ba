// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "dyop/geometry/triangle_mesh.h"

namespace dyop::internal {

// Farthest vertices of a convex polytope by climbing along its edges.
class HullClimber {
 public:
  // `surface` is closed and convex exactly, as quickhull() makes it.
  explicit HullClimber(const TriangleMesh& surface);

  // A vertex no neighbor of which lies farther along the direction, beyond doubt by rounding: on a
  // convex polytope no vertex at all does. Nothing if rounding leaves a doubt, or if the climb
  // takes more work than a scan of all vertices.
  std::optional<std::int32_t> find(const Vector3& direction) const;

 private:
  std::int32_t best_start(const Vector3& direction) const;

  TriangleMesh surface_;
  std::vector<std::int32_t> first_;  // by vertex: where its neighbors begin; one more at the end
  std::vector<std::int32_t> neighbors_;
  std::vector<std::int32_t> starts_;  // vertices that are farthest along spread directions
};

}  // namespace dyop::internal
