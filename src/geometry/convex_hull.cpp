// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/convex_hull.h"

#include <limits>
#include <optional>
#include <utility>

#include "geometry/hull/hull_climber.h"
#include "geometry/hull/quickhull.h"
#include "geometry/solid.h"

namespace dyop {
namespace {

// With up to this many vertices a scan is faster than climbing.
constexpr std::size_t kLargestScan = 128;

TriangleMesh surface_mesh(const std::vector<Vector3>& points,
                          std::vector<TriangleIndices> triangles) {
  std::vector<std::int32_t> number(points.size(), -1);
  for (const TriangleIndices& t : triangles) {
    for (const std::int32_t v : t) number[std::size_t(v)] = 0;
  }
  std::vector<Vector3> vertices;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (number[k] < 0) continue;
    number[k] = std::int32_t(vertices.size());
    vertices.push_back(points[k]);
  }
  for (TriangleIndices& t : triangles) {
    for (std::int32_t& v : t) v = number[std::size_t(v)];
  }
  return TriangleMesh(std::move(vertices), std::move(triangles));
}

geometry_internal::HullSurface checked_quickhull(const std::vector<Vector3>& points) {
  constexpr std::size_t kMost = std::numeric_limits<std::int32_t>::max();
  DYOP_REQUIRE(!points.empty() && points.size() <= kMost, "a convex hull needs 1 to ", kMost,
               " points, not ", points.size());
  for (std::size_t row = 0; row < points.size(); ++row) {
    const Vector3& p = points[row];
    // False for NaN.
    DYOP_REQUIRE((p.array().abs() <= kLargestCoordinate).all(), "point ", row,
                 " is not finite or beyond ", kLargestCoordinate, ": (", p.x(), ", ", p.y(), ", ",
                 p.z(), ")");
  }
  return geometry_internal::quickhull(points);
}

Vector3 mean(std::span<const Vector3> points) {
  Vector3 sum = Vector3::Zero();
  for (const Vector3& p : points) sum += p / Scalar(points.size());
  return sum;
}

std::shared_ptr<const geometry_internal::HullClimber> climber_for(const TriangleMesh& surface,
                                                                  int dimension) {
  if (dimension < 3 || surface.vertices().size() <= kLargestScan) return nullptr;
  return std::make_shared<const geometry_internal::HullClimber>(surface);
}

}  // namespace

ConvexHull::ConvexHull(std::vector<Vector3> points)
    : ConvexHull(points, checked_quickhull(points)) {}

ConvexHull::ConvexHull(const std::vector<Vector3>& points, geometry_internal::HullSurface&& hull)
    : dimension_(hull.dimension),
      surface_(surface_mesh(points, std::move(hull.triangles))),
      center_(mean(surface_.vertices())),
      scan_(std::make_shared<const geometry_internal::PointScan>(surface_.vertices())),
      climber_(climber_for(surface_, dimension_)) {}

SupportPoint ConvexHull::core_support(const Vector3& direction) const {
  const std::span<const Vector3> all = vertices();
  if (climber_) {
    const std::optional<std::int32_t> vertex = climber_->find(direction);
    if (vertex) return {all[std::size_t(*vertex)], *vertex};
  }
  const std::int32_t vertex = scan_->farthest(direction);
  return {all[std::size_t(vertex)], vertex};
}

Scalar ConvexHull::core_reach(const Vector3& direction) const {
  if (climber_) return ConvexShape::core_reach(direction);
  return scan_->reach(direction);
}

MassProperties ConvexHull::compute_mass_properties(Scalar density) const {
  DYOP_REQUIRE(dimension_ == 3, "a convex hull of dimension ", dimension_,
               " encloses no volume and has no mass");
  return surface_.compute_mass_properties(density);
}

}  // namespace dyop
