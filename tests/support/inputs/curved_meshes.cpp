// SPDX-License-Identifier: BSD-3-Clause
#include "support/inputs/curved_meshes.h"

#include <cmath>
#include <numbers>

namespace dyop::testing {

namespace {

constexpr Scalar kPi = std::numbers::pi;

// Direction in the plane y = 0 at this angle from straight below, towards +x.
Vector3 below(Scalar angle) {
  return {std::sin(angle), 0, -std::cos(angle)};
}

}  // namespace

MeshArrays prism(const std::vector<Vector3>& polygon, Scalar half_width) {
  MeshArrays mesh;
  const auto count = static_cast<std::int32_t>(polygon.size());
  for (const Scalar y : {-half_width, half_width}) {
    for (const Vector3& p : polygon) mesh.vertices.emplace_back(p.x(), y, p.z());
  }
  for (std::int32_t k = 0; k < count; ++k) {
    const std::int32_t next = (k + 1) % count;
    mesh.triangles.push_back({k, count + next, next});
    mesh.triangles.push_back({k, count + k, count + next});
    if (k == 0 || next == 0) continue;
    mesh.triangles.push_back({0, k, next});
    mesh.triangles.push_back({count, count + next, count + k});
  }
  return mesh;
}

MeshArrays disc(Scalar radius, Scalar half_width, int facets) {
  std::vector<Vector3> rim;
  for (int k = 0; k < facets; ++k) rim.push_back(radius * below(2 * kPi * k / facets));
  return prism(rim, half_width);
}

MeshArrays half_disc(Scalar radius, Scalar half_width, int facets) {
  std::vector<Vector3> rim;
  for (int k = 0; k <= facets; ++k) rim.push_back(radius * below(kPi * k / facets - kPi / 2));
  return prism(rim, half_width);
}

std::vector<Vector3> oloid_points(Scalar radius, int facets) {
  std::vector<Vector3> points;
  for (int k = 0; k < facets; ++k) {
    const Vector3 p = radius * below(2 * kPi * k / facets);
    points.emplace_back(p.z() - radius / 2, p.x(), 0);
    points.emplace_back(radius / 2 - p.z(), 0, p.x());
  }
  return points;
}

MeshArrays trough(Scalar radius, Scalar half_width, Scalar span, int facets) {
  MeshArrays mesh;
  for (int k = 0; k <= facets; ++k) {
    const Vector3 p = radius * below(span * (2.0 * k / facets - 1));
    mesh.vertices.emplace_back(p.x(), -half_width, p.z());
    mesh.vertices.emplace_back(p.x(), half_width, p.z());
    if (k == 0) continue;
    const std::int32_t i = 2 * k;
    mesh.triangles.push_back({i - 2, i, i + 1});
    mesh.triangles.push_back({i - 2, i + 1, i - 1});
  }
  return mesh;
}

MeshArrays bowl(Scalar radius, Scalar span, int rings) {
  MeshArrays mesh;
  // Ring k has 6 k vertices: nearly equilateral triangles.
  mesh.vertices.push_back(radius * below(0));
  std::vector<std::int32_t> first{0};
  for (int k = 1; k <= rings; ++k) {
    first.push_back(static_cast<std::int32_t>(mesh.vertices.size()));
    const Vector3 p = radius * below(span * k / rings);
    for (int i = 0; i < 6 * k; ++i) {
      const Scalar angle = 2 * kPi * i / (6 * k);
      mesh.vertices.emplace_back(p.x() * std::cos(angle), p.x() * std::sin(angle), p.z());
    }
    const std::int32_t inner = first[std::size_t(k) - 1];
    const std::int32_t outer = first[std::size_t(k)];
    const int inner_count = std::max(1, 6 * (k - 1));
    for (int sector = 0; sector < 6; ++sector) {
      for (int i = 0; i < k; ++i) {
        const std::int32_t a = inner + (sector * (k - 1) + i) % inner_count;
        const std::int32_t b = outer + sector * k + i;
        const std::int32_t c = outer + (sector * k + i + 1) % (6 * k);
        mesh.triangles.push_back({a, b, c});
        if (i + 1 == k) continue;
        mesh.triangles.push_back({a, c, inner + (sector * (k - 1) + i + 1) % inner_count});
      }
    }
  }
  return mesh;
}

}  // namespace dyop::testing
