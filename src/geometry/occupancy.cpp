// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/occupancy.h"

#include <map>
#include <memory>
#include <vector>

#include "dyop/core/error.h"
#include "dyop/geometry/primitives.h"

namespace dyop {
namespace {

CompoundChild child_at(std::shared_ptr<const Shape> shape, const Vector3& place, std::size_t number,
                       const char* what) {
  DYOP_REQUIRE(place.allFinite(), what, " ", number, " must be finite, not ", place.transpose());
  return {std::move(shape), RigidPose(place)};
}

}  // namespace

CompoundShape occupancy(std::span<const OccupiedCube> cubes) {
  DYOP_REQUIRE(!cubes.empty(), "occupancy needs at least one cube");
  std::map<Scalar, std::shared_ptr<const Box>> boxes;  // by size
  std::vector<CompoundChild> children;
  children.reserve(cubes.size());
  for (std::size_t k = 0; k < cubes.size(); ++k) {
    const Scalar size = cubes[k].size;
    DYOP_REQUIRE(size > 0, "the size of cube ", k, " must be > 0, not ", size);
    std::shared_ptr<const Box>& box = boxes[size];
    if (!box) box = std::make_shared<Box>(Vector3::Constant(size / 2));
    children.push_back(child_at(box, cubes[k].center, k, "the center of cube"));
  }
  return CompoundShape(children);
}

CompoundShape point_cloud(std::span<const Vector3> points, Scalar radius) {
  DYOP_REQUIRE(!points.empty(), "a point cloud needs at least one point");
  const auto ball = std::make_shared<Sphere>(radius);
  std::vector<CompoundChild> children;
  children.reserve(points.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    children.push_back(child_at(ball, points[k], k, "point"));
  }
  return CompoundShape(children);
}

}  // namespace dyop
