// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "toi/deforming/standing_pair.h"

namespace dyop {
namespace {

using toi_internal::MeshSlabs;

constexpr Scalar kSlabNoise = 1e-11;  // literal: more than the rounding of numbers of size 100

struct Bounds {
  Scalar of_slab;
  Scalar of_box;
};

Bounds bounds_of(const DeformingMesh& mesh, const MeshSlabs& slabs, std::size_t number, Scalar s,
                 const Vector3& n_W) {
  const DeformingMesh::Node& node = mesh.nodes()[number];
  const Vector3 lowest = (1 - s) * node.at_begin.min() + s * node.at_end.min();
  const Vector3 highest = (1 - s) * node.at_begin.max() + s * node.at_end.max();
  const Vector3 center = (lowest + highest) / 2, half = (highest - lowest) / 2;
  return {slabs.support(std::int32_t(number), s, n_W, center, half),
          n_W.dot(center) + n_W.cwiseAbs().dot(half)};
}

Scalar true_support(const DeformingMesh& mesh, std::size_t number, Scalar s, const Vector3& n_W) {
  const DeformingMesh::Node& node = mesh.nodes()[number];
  Scalar largest = -kInfinity;
  if (node.is_leaf) {
    for (const Vector3& p : mesh.triangle(node.first, s)) largest = std::max(largest, n_W.dot(p));
    return largest;
  }
  for (const std::int32_t part : {node.first, node.first + 1}) {
    largest = std::max(largest, true_support(mesh, std::size_t(part), s, n_W));
  }
  return largest;
}

void expect_bounds_hold(const DeformingMesh& mesh, const MeshSlabs& slabs,
                        std::mt19937_64& random) {
  for (int k = 0; k < 500; ++k) {
    const auto number = std::size_t(testing::random_index(int(mesh.nodes().size()), random));
    const Scalar s = k % 5 == 0 ? Scalar(k % 2) : testing::random_number(0, 1, random);
    // Across the slab as well, where its bound alone counts.
    const Vector3 n_W = k % 3 == 0 ? Vector3((k % 2 == 0 ? 1 : -1) * slabs.normal(int(number)))
                                   : testing::random_direction(random);
    EXPECT_GE(bounds_of(mesh, slabs, number, s, n_W).of_slab,
              true_support(mesh, number, s, n_W) - kSlabNoise);
  }
}

TEST(MeshSlabs, BoundEveryNodeAlongAnyDirection) {
  std::mt19937_64 random(9);
  const auto arrays = testing::icosphere(3);
  std::vector<Vector3> begin = arrays.vertices, end = arrays.vertices;
  for (Vector3& p : begin) p = 20 * p + testing::random_vector(2, random);
  for (Vector3& p : end) p = 20 * p + testing::random_vector(4, random);
  DeformingMesh mesh(begin, end, arrays.triangles);
  MeshSlabs slabs(mesh);
  expect_bounds_hold(mesh, slabs, random);
  // After a refit that turns the mesh inside out.
  for (Vector3& p : begin) p = -p;
  mesh.refit(end, begin);
  slabs.fit(mesh);
  expect_bounds_hold(mesh, slabs, random);
}

TEST(MeshSlabs, BoundTrianglesWithoutArea) {
  std::mt19937_64 random(9);
  const std::vector<Vector3> begin{{0, 0, 0}, {1, 2, 3}, {2, 4, 6}, {5, 5, 5}};
  std::vector<Vector3> end = begin;
  for (Vector3& p : end) p += testing::random_vector(1, random);
  const DeformingMesh mesh(begin, end, {{0, 0, 0}, {0, 1, 2}, {3, 1, 1}, {0, 1, 2}, {2, 1, 0}});
  expect_bounds_hold(mesh, MeshSlabs(mesh), random);
}

// A smooth surface that is inclined to the axes: the slack of a box goes with its size, that of a
// slab with its square.
TEST(MeshSlabs, AreThinOnAnInclinedSurface) {
  const DeformingMesh mesh = [] {
    const auto arrays = testing::icosphere(4);
    return DeformingMesh(arrays.vertices, arrays.vertices, arrays.triangles);
  }();
  const MeshSlabs slabs(mesh);
  const Vector3 n_W = Vector3(1, 1, 1).normalized();
  int tried = 0;
  for (std::size_t number = 0; number < mesh.nodes().size(); ++number) {
    const Vector3 size = mesh.nodes()[number].at_begin.sizes();
    const bool is_patch = size.norm() > 0.2 && size.norm() < 0.4;
    if (!is_patch || slabs.normal(std::int32_t(number)).dot(n_W) < 0.98) continue;
    ++tried;
    const Bounds bounds = bounds_of(mesh, slabs, number, 0, n_W);
    const Scalar truth = true_support(mesh, number, 0, n_W);
    EXPECT_LT(bounds.of_slab - truth, 0.4 * (bounds.of_box - truth)) << number;
  }
  EXPECT_GT(tried, 3);
}

}  // namespace
}  // namespace dyop
