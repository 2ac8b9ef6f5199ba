// SPDX-License-Identifier: BSD-3-Clause
#include "io/haptics/geodesic_sphere.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <utility>

#include "dyop/core/error.h"

namespace dyop::io_internal {
namespace {

constexpr std::size_t kCorners = 12;
using Corners = std::array<Vector3, kCorners>;

Corners icosahedron_corners() {
  Corners corners;
  std::size_t next = 0;
  for (const Scalar side : {1, -1}) {
    for (const Scalar top : {std::numbers::phi, -std::numbers::phi}) {
      for (const Vector3& p : {Vector3(0, side, top), Vector3(side, top, 0), Vector3(top, 0, side)})
        corners[next++] = p.normalized();
    }
  }
  return corners;
}

// All three corners that are neighbours of each other, counterclockwise seen from outside.
std::vector<TriangleIndices> icosahedron_faces(const Corners& corners) {
  // The cosine between two neighbours is 1/sqrt(5), that between any two others is negative.
  const auto near = [&](std::size_t i, std::size_t k) { return corners[i].dot(corners[k]) > 0; };
  std::vector<TriangleIndices> faces;
  for (std::size_t i = 0; i < kCorners; ++i) {
    for (std::size_t j = i + 1; j < kCorners; ++j) {
      for (std::size_t k = j + 1; k < kCorners; ++k) {
        if (!near(i, j) || !near(j, k) || !near(k, i)) continue;
        TriangleIndices face{std::int32_t(i), std::int32_t(j), std::int32_t(k)};
        if (corners[i].cross(corners[j]).dot(corners[k]) < 0) std::swap(face[1], face[2]);
        faces.push_back(face);
      }
    }
  }
  return faces;
}

// The vertices of a sphere whose icosahedron has `frequency` triangles along an edge. Each is given
// by the weights of the corners, which sum up to the frequency, so that faces share their edges'.
class DividedIcosahedron {
 public:
  explicit DividedIcosahedron(std::int32_t frequency) : frequency_(frequency) {}

  void add(const TriangleIndices& face) {
    for (std::int32_t i = 0; i < frequency_; ++i) {
      for (std::int32_t k = 0; i + k < frequency_; ++k) {
        const std::int32_t ahead = vertex(face, i + 1, k), aside = vertex(face, i, k + 1);
        mesh_.triangles.push_back({vertex(face, i, k), ahead, aside});
        if (i + k + 1 < frequency_)
          mesh_.triangles.push_back({ahead, vertex(face, i + 1, k + 1), aside});
      }
    }
  }

  const Corners& corners() const { return corners_; }
  AnatomyMesh take() { return std::move(mesh_); }

 private:
  using Weights = std::array<std::int32_t, kCorners>;

  // The vertex i steps from the face's first corner towards its second, and k towards its third.
  std::int32_t vertex(const TriangleIndices& face, std::int32_t i, std::int32_t k) {
    Weights weights{};
    weights[std::size_t(face[0])] = frequency_ - i - k;
    weights[std::size_t(face[1])] = i;
    weights[std::size_t(face[2])] = k;
    const auto [place, is_new] = numbers_.try_emplace(weights, std::int32_t(numbers_.size()));
    if (is_new) mesh_.vertices.push_back(direction(weights));
    return place->second;
  }

  // Along an edge these are equal angles, and the middle of a face is not much coarser.
  Vector3 direction(const Weights& weights) const {
    const Scalar angle = std::acos(1 / std::sqrt(Scalar{5}));  // of an edge
    Vector3 sum = Vector3::Zero();
    for (std::size_t c = 0; c < kCorners; ++c)
      sum += std::sin(angle * Scalar(weights[c]) / Scalar(frequency_)) * corners_[c];
    return sum.normalized();
  }

  Corners corners_ = icosahedron_corners();
  std::int32_t frequency_;
  std::map<Weights, std::int32_t> numbers_;
  AnatomyMesh mesh_;
};

}  // namespace

AnatomyMesh geodesic_sphere(std::size_t triangles) {
  DYOP_REQUIRE(triangles >= 32, "anatomy: there must be at least 32 triangles, not ", triangles);
  const auto below = std::int32_t(std::sqrt(Scalar(triangles) / 20));
  const auto count = [](std::int32_t f) { return 20 * Scalar(f) * Scalar(f); };
  const bool is_lower_nearer =
      Scalar(triangles) - count(below) <= count(below + 1) - Scalar(triangles);
  DividedIcosahedron sphere(is_lower_nearer ? below : below + 1);
  for (const TriangleIndices& face : icosahedron_faces(sphere.corners())) sphere.add(face);
  return sphere.take();
}

}  // namespace dyop::io_internal
