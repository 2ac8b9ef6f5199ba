// SPDX-License-Identifier: BSD-3-Clause
#include "io/mesh/mesh_reader.h"

#include "dyop/core/error.h"

namespace dyop::io_internal {
namespace {

// A polygon in the plane of its vector area, seen from the side where it turns left.
class PlanarPolygon {
 public:
  PlanarPolygon(const std::vector<Vector3>& vertices, std::span<const std::int32_t> polygon) {
    const Vector3& origin = vertices[std::size_t(polygon[0])];
    Vector3 area = Vector3::Zero();
    for (std::size_t k = 2; k < polygon.size(); ++k) {
      area += (vertices[std::size_t(polygon[k - 1])] - origin)
                  .cross(vertices[std::size_t(polygon[k])] - origin);
    }
    Eigen::Index across = 0;  // the axis of projection
    area.cwiseAbs().maxCoeff(&across);
    Eigen::Index right = (across + 1) % 3;
    Eigen::Index up = (across + 2) % 3;
    if (area[across] < 0) std::swap(right, up);
    for (const std::int32_t vertex : polygon) {
      const Vector3 p = vertices[std::size_t(vertex)] - origin;
      points_.emplace_back(p[right], p[up]);
    }
  }

  // Twice the area of the triangle of three corners; positive if it turns left.
  Scalar turn(std::size_t i, std::size_t j, std::size_t k) const {
    const Vector2 u = points_[j] - points_[i];
    const Vector2 v = points_[k] - points_[i];
    return u.x() * v.y() - u.y() * v.x();
  }

  bool is_strictly_convex() const {
    const std::size_t n = points_.size();
    for (std::size_t k = 0; k < n; ++k) {
      if (!(turn(k, (k + 1) % n, (k + 2) % n) > 0)) return false;
    }
    return true;
  }

  // Whether corner k is in the triangle or on its border, unless it coincides with one of its
  // corners.
  bool is_within(std::size_t k, std::size_t i0, std::size_t i1, std::size_t i2) const {
    if (points_[k] == points_[i0] || points_[k] == points_[i1] || points_[k] == points_[i2]) {
      return false;
    }
    return turn(i0, i1, k) >= 0 && turn(i1, i2, k) >= 0 && turn(i2, i0, k) >= 0;
  }

 private:
  std::vector<Vector2> points_;
};

// Cuts ears off a polygon until a triangle is left, or a polygon without ears.
class EarCutter {
 public:
  explicit EarCutter(const PlanarPolygon& polygon, std::size_t count) : polygon_(polygon) {
    for (std::size_t k = 0; k < count; ++k) left_.push_back(k);
  }

  // Calls add(i, j, k) with the corners of every triangle.
  template <typename Add>
  void cut(Add add) {
    std::size_t place = 1;  // index of the ear's tip in left_
    std::size_t tried = 0;
    while (left_.size() > 3 && tried < left_.size()) {
      place %= left_.size();
      if (!is_ear(place)) {
        ++place;
        ++tried;
        continue;
      }
      add(before(place), left_[place], after(place));
      left_.erase(left_.begin() + std::ptrdiff_t(place));
      tried = 0;
    }
    for (std::size_t k = 2; k < left_.size(); ++k) add(left_[0], left_[k - 1], left_[k]);
  }

 private:
  std::size_t before(std::size_t place) const {
    return left_[(place + left_.size() - 1) % left_.size()];
  }
  std::size_t after(std::size_t place) const { return left_[(place + 1) % left_.size()]; }

  bool is_ear(std::size_t place) const {
    const std::size_t i0 = before(place);
    const std::size_t i1 = left_[place];
    const std::size_t i2 = after(place);
    if (!(polygon_.turn(i0, i1, i2) > 0)) return false;
    for (const std::size_t k : left_) {
      if (k != i0 && k != i1 && k != i2 && polygon_.is_within(k, i0, i1, i2)) return false;
    }
    return true;
  }

  const PlanarPolygon& polygon_;
  std::vector<std::size_t> left_;
};

}  // namespace

void append_triangles(const std::vector<Vector3>& vertices, std::span<const std::int32_t> polygon,
                      std::vector<TriangleIndices>& triangles) {
  const std::size_t n = polygon.size();
  const auto add = [&](std::size_t i, std::size_t j, std::size_t k) {
    triangles.push_back({polygon[i], polygon[j], polygon[k]});
  };
  if (n <= 3) return add(0, n > 1 ? 1 : 0, n - 1);
  const PlanarPolygon planar(vertices, polygon);
  if (planar.is_strictly_convex()) {
    for (std::size_t k = 2; k < n; ++k) add(0, k - 1, k);
    return;
  }
  DYOP_REQUIRE(n <= kMostConcaveCorners, "a polygon of ", n,
               " corners is not strictly convex; at most ", kMostConcaveCorners,
               " corners are supported then");
  EarCutter(planar, n).cut(add);
}

}  // namespace dyop::io_internal
