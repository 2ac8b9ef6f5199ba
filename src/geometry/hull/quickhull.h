// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/instruction_set.h"
#include "dyop/core/export.h"
#include "dyop/core/types.h"
#include "dyop/geometry/triangle_mesh.h"
#include "geometry/hull/point_scan.h"

namespace dyop::geometry_internal {

// The surface of a convex hull, with the input's point numbers.
struct HullSurface {
  int dimension = 0;
  // Dimension 3: closed, facing outwards. 2: a fan over the polygon. 1, 0: one triangle with
  // repeated numbers.
  std::vector<TriangleIndices> triangles;
};

// Convex hull of at least one finite point. Every point lies in the hull of those that the
// triangles use, exactly, except that coordinates below 2^-200 of the largest count as zero.
HullSurface quickhull(std::span<const Vector3> points);

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

// Finds farthest points of a fixed list by testing all of them, several at a time.
class DYOP_EXPORT PointScan {
 public:
  // At least one point.
  explicit PointScan(std::span<const Vector3> points,
                     core_internal::InstructionSet set = core_internal::best_instruction_set());

  // The first of the points with the largest computed direction . p; 0 if that is NaN.
  std::int32_t farthest(const Vector3& direction) const;

  // The largest computed direction . p; NaN if the direction is not finite.
  Scalar reach(const Vector3& direction) const;

 private:
  // Calls visit(blocks, count, number of the first point).
  template <typename Visit>
  void for_each_part(const Visit& visit) const;

  ScanKernels kernels_;
  std::vector<ScanBlock> blocks_;  // the last one is filled up with the last point
};

}  // namespace dyop::geometry_internal
