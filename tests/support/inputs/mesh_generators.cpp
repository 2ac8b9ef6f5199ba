// SPDX-License-Identifier: BSD-3-Clause
#include "support/inputs/mesh_generators.h"

#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <utility>

namespace dyop::testing {
namespace {

constexpr Scalar kTwoPi = 2 * std::numbers::pi;

Vector3 random_point(std::mt19937_64& random) {
  std::uniform_real_distribution<Scalar> coordinate(-1, 1);
  const Scalar x = coordinate(random);
  const Scalar y = coordinate(random);
  return {x, y, coordinate(random)};
}

MeshArrays icosahedron() {
  const Scalar g = std::numbers::phi;
  return {{{-1, g, 0},
           {1, g, 0},
           {-1, -g, 0},
           {1, -g, 0},
           {0, -1, g},
           {0, 1, g},
           {0, -1, -g},
           {0, 1, -g},
           {g, 0, -1},
           {g, 0, 1},
           {-g, 0, -1},
           {-g, 0, 1}},
          {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
           {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
           {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};
}

void subdivide(MeshArrays& mesh) {
  std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> middles;
  const auto middle = [&](std::int32_t a, std::int32_t b) {
    const auto [entry, is_new] =
        middles.try_emplace(std::minmax(a, b), std::int32_t(mesh.vertices.size()));
    if (is_new) {
      mesh.vertices.push_back(0.5 *
                              (mesh.vertices[std::size_t(a)] + mesh.vertices[std::size_t(b)]));
    }
    return entry->second;
  };
  std::vector<TriangleIndices> finer;
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::int32_t ab = middle(a, b);
    const std::int32_t bc = middle(b, c);
    const std::int32_t ca = middle(c, a);
    finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
  }
  mesh.triangles = std::move(finer);
}

}  // namespace

MeshArrays MeshArrays::moved(const Matrix3& rotation, const Vector3& translation,
                             Scalar scale) const {
  MeshArrays result = *this;
  for (Vector3& p : result.vertices) p = rotation * (scale * p) + translation;
  return result;
}

MeshArrays icosphere(int subdivisions, Scalar radius) {
  MeshArrays mesh = icosahedron();
  for (int k = 0; k < subdivisions; ++k) {
    subdivide(mesh);
    for (Vector3& p : mesh.vertices) p.normalize();
  }
  for (Vector3& p : mesh.vertices) p = radius * p.normalized();
  return mesh;
}

MeshArrays torus(Scalar major_radius, Scalar minor_radius, int major_segments, int minor_segments) {
  MeshArrays mesh;
  const auto number = [&](int i, int j) {
    return std::int32_t((i % major_segments) * minor_segments + j % minor_segments);
  };
  for (int i = 0; i < major_segments; ++i) {
    for (int j = 0; j < minor_segments; ++j) {
      const Scalar u = kTwoPi * i / major_segments;
      const Scalar v = kTwoPi * j / minor_segments;
      const Scalar r = major_radius + minor_radius * std::cos(v);
      mesh.vertices.emplace_back(r * std::cos(u), r * std::sin(u), minor_radius * std::sin(v));
      mesh.triangles.push_back({number(i, j), number(i + 1, j), number(i + 1, j + 1)});
      mesh.triangles.push_back({number(i, j), number(i + 1, j + 1), number(i, j + 1)});
    }
  }
  return mesh;
}

MeshArrays box_mesh(const Vector3& half_extents) {
  MeshArrays mesh;
  for (int k = 0; k < 8; ++k) {
    mesh.vertices.emplace_back((k & 1 ? 1 : -1) * half_extents.x(),
                               (k & 2 ? 1 : -1) * half_extents.y(),
                               (k & 4 ? 1 : -1) * half_extents.z());
  }
  mesh.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
  return mesh;
}

MeshArrays plate_grid(Scalar size_x, Scalar size_y, int cells_x, int cells_y) {
  MeshArrays mesh;
  const auto number = [&](int i, int j) { return std::int32_t(i * (cells_y + 1) + j); };
  for (int i = 0; i <= cells_x; ++i) {
    for (int j = 0; j <= cells_y; ++j) {
      mesh.vertices.emplace_back(size_x * (Scalar(i) / cells_x - 0.5),
                                 size_y * (Scalar(j) / cells_y - 0.5), 0);
      if (i == cells_x || j == cells_y) continue;
      mesh.triangles.push_back({number(i, j), number(i + 1, j), number(i + 1, j + 1)});
      mesh.triangles.push_back({number(i, j), number(i + 1, j + 1), number(i, j + 1)});
    }
  }
  return mesh;
}

MeshArrays needle(Scalar length, int segments) {
  MeshArrays mesh;
  for (int k = 0; k <= segments; ++k) mesh.vertices.emplace_back(0, 0, length * k / segments);
  for (int k = 0; k < segments; ++k) mesh.triangles.push_back({k, k + 1, k + 1});
  return mesh;
}

MeshArrays point_cloud(int count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  MeshArrays mesh;
  for (int k = 0; k < count; ++k) {
    mesh.vertices.push_back(random_point(random));
    mesh.triangles.push_back({k, k, k});
  }
  return mesh;
}

MeshArrays random_soup(int count, Scalar size, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  MeshArrays mesh;
  for (int k = 0; k < count; ++k) {
    const Vector3 center = random_point(random);
    Triangle t{center + size * random_point(random), center + size * random_point(random),
               center + size * random_point(random)};
    switch (k % 12) {
      case 2:  // a segment
        t[2] = t[1];
        break;
      case 5:  // a point
        t[1] = t[2] = t[0];
        break;
      case 8:  // a sliver: the third corner on the line of the others, up to rounding
        t[2] = 0.3 * t[0] + 0.7 * t[1];
        break;
      case 11:  // the previous triangle again
        for (std::size_t c = 0; c < 3; ++c) t[c] = mesh.vertices[mesh.vertices.size() - 3 + c];
        break;
      default:
        break;
    }
    for (const Vector3& p : t) mesh.vertices.push_back(p);
    mesh.triangles.push_back({3 * k, 3 * k + 1, 3 * k + 2});
  }
  return mesh;
}

MeshArrays gear(int teeth, Scalar root_radius, Scalar tip_radius, Scalar thickness) {
  MeshArrays mesh;
  const int rim = 4 * teeth;
  for (const Scalar z : {-thickness / 2, thickness / 2}) {
    for (int k = 0; k < rim; ++k) {
      const Scalar angle = kTwoPi * k / rim;
      const Scalar r = k % 4 < 2 ? root_radius : tip_radius;
      mesh.vertices.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
    }
    mesh.vertices.emplace_back(0, 0, z);
  }
  // Each layer has its rim, then its middle.
  const std::int32_t top = rim + 1;
  for (int k = 0; k < rim; ++k) {
    const int next = (k + 1) % rim;
    mesh.triangles.push_back({rim, next, k});
    mesh.triangles.push_back({top + rim, top + k, top + next});
    mesh.triangles.push_back({k, next, top + next});
    mesh.triangles.push_back({k, top + next, top + k});
  }
  return mesh;
}

}  // namespace dyop::testing
