// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <numbers>
#include <utility>

#include "dyop/core/error.h"
#include "dyop/io/haptic_scene_file.h"

namespace dyop::io_internal {

/// The unit sphere as a finely divided icosahedron: at most six triangles meet at a vertex, and
/// none is a needle.
/// @param triangles The number wished for, >= 32; it has 20 f^2, for the f that comes nearest.
AnatomyMesh geodesic_sphere(std::size_t triangles);

}  // namespace dyop::io_internal

namespace dyop {
namespace {

// A closed surface around an axis: rings of `around` vertices between two poles. Two parameters in
// [0, 1] give the position of a vertex: from pole to pole, and around.
AnatomyMesh closed_grid(std::size_t triangles, Scalar slimness,
                        const std::function<Vector3(Scalar along, Scalar round)>& place) {
  DYOP_REQUIRE(triangles >= 32, "anatomy: there must be at least 32 triangles, not ", triangles);
  const auto around =
      std::int32_t(std::max(4.0, std::round(std::sqrt(Scalar(triangles) / (2 * slimness)))));
  const auto rings =
      std::int32_t(std::max(2.0, std::round(Scalar(triangles) / (2 * Scalar(around)))));
  AnatomyMesh mesh;
  for (std::int32_t i = 0; i < rings; ++i) {
    for (std::int32_t k = 0; k < around; ++k) {
      mesh.vertices.push_back(place(Scalar(i + 1) / Scalar(rings + 1), Scalar(k) / Scalar(around)));
    }
  }
  const std::int32_t first = rings * around;
  mesh.vertices.push_back(place(0, 0));
  mesh.vertices.push_back(place(1, 0));
  for (std::int32_t k = 0; k < around; ++k) {
    const std::int32_t next = (k + 1) % around;
    mesh.triangles.push_back({first, next, k});
    for (std::int32_t i = 0; i + 1 < rings; ++i) {
      const std::int32_t row = i * around;
      mesh.triangles.push_back({row + k, row + next, row + around + next});
      mesh.triangles.push_back({row + k, row + around + next, row + around + k});
    }
    const std::int32_t row = (rings - 1) * around;
    mesh.triangles.push_back({row + k, row + next, first + 1});
  }
  return mesh;
}

// A round body about z: its radius at each height, from s = 0 to 1.
AnatomyMesh turned(std::size_t triangles, Scalar slimness, Scalar length,
                   const std::function<Scalar(Scalar)>& radius) {
  return closed_grid(triangles, slimness, [&](Scalar s, Scalar round) {
    const Scalar angle = 2 * std::numbers::pi * round;
    return Vector3(radius(s) * std::cos(angle), radius(s) * std::sin(angle), s * length);
  });
}

}  // namespace

AnatomyMesh make_liver(std::size_t triangles) {
  AnatomyMesh mesh = io_internal::geodesic_sphere(triangles);
  const Vector3 radii(80, 55, 35);
  // Evenly spread directions would be stretched by each axis' radius. These are drawn together
  // towards the long axes; the power is the one that leaves the least ratio of edges, 2.5.
  const Vector3 draw = radii.array().pow(-0.6);
  for (Vector3& p : mesh.vertices) {
    const Vector3 n = p.cwiseProduct(draw).normalized();
    const Scalar lumps = 1 + 0.08 * std::sin(3 * n.x() + 1) * std::cos(4 * n.y()) +
                         0.05 * std::sin(6 * n.y() + 5 * n.z());
    const Scalar lobe = 1 - 0.3 * n.x();  // thick on one side, thin on the other
    p = lumps * radii.cwiseProduct(Vector3(n.x(), n.y(), lobe * n.z()));
  }
  return mesh;
}

AnatomyMesh make_vessel(std::size_t triangles) {
  return closed_grid(triangles, 6, [](Scalar s, Scalar round) {
    const Scalar angle = 2 * std::numbers::pi * round;
    // Its ends are round.
    const Scalar radius = 3 * std::sqrt(std::max(0.0, 1 - std::pow(2 * s - 1, 40)));
    const Vector3 middle(140 * (s - 0.5), 12 * std::sin(2 * std::numbers::pi * s),
                         8 * std::cos(3 * s));
    return Vector3(middle + radius * Vector3(0, std::sin(angle), -std::cos(angle)));
  });
}

AnatomyMesh make_wall(std::size_t triangles) {
  DYOP_REQUIRE(triangles >= 32, "anatomy: there must be at least 32 triangles, not ", triangles);
  const auto cells = std::int32_t(std::round(std::sqrt(Scalar(triangles) / 2)));
  AnatomyMesh mesh;
  for (std::int32_t i = 0; i <= cells; ++i) {
    for (std::int32_t k = 0; k <= cells; ++k) {
      const Scalar x = Scalar(i) / Scalar(cells) - 0.5, y = Scalar(k) / Scalar(cells) - 0.5;
      mesh.vertices.emplace_back(240 * x, 240 * y, -160 * (x * x + y * y));
    }
  }
  for (std::int32_t i = 0; i < cells; ++i) {
    for (std::int32_t k = 0; k < cells; ++k) {
      const std::int32_t corner = i * (cells + 1) + k;
      mesh.triangles.push_back({corner, corner + cells + 1, corner + cells + 2});
      mesh.triangles.push_back({corner, corner + cells + 2, corner + 1});
    }
  }
  return mesh;
}

AnatomyMesh make_shaft(std::size_t triangles, Scalar radius, Scalar length) {
  // Rounded ends, of the rod's own radius.
  return turned(triangles, 4, length, [&](Scalar s) {
    const Scalar from_end = std::min(s, 1 - s) * length;
    const Scalar below = std::max(Scalar{0}, radius - from_end);
    return std::sqrt(std::max(Scalar{0}, radius * radius - below * below));
  });
}

AnatomyMesh make_jaw(std::size_t triangles, Scalar radius, Scalar length) {
  AnatomyMesh mesh = turned(triangles, 2, length, [&](Scalar s) {
    const Scalar taper = 1 - 0.6 * s;
    return radius * taper * std::sqrt(std::max(Scalar{0}, 1 - std::pow(2 * s - 1, 20)));
  });
  for (Vector3& p : mesh.vertices) {
    // One half, slightly off centre, pointing down. Two reflections keep the winding.
    const Scalar off = 0.05 * radius + 0.9 * std::max(Scalar{0}, p.x()) + 0.1 * (p.x() + radius);
    p = Vector3(-off, p.y(), -p.z());
  }
  return mesh;
}

}  // namespace dyop

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
