// SPDX-License-Identifier: BSD-3-Clause
#include "toi/nearest_difference.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "support/inputs/path_inputs.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/path_oracle.h"

namespace dyop::toi_internal {
namespace {

using testing::FourPaths;
using testing::PathKind;

Differences<3> differences(const VertexFacePaths& paths) {
  Differences<3> corners;
  for (std::size_t k = 0; k < 3; ++k) corners[k] = paths.face[k].begin - paths.vertex.begin;
  return corners;
}

Differences<4> differences(const EdgeEdgePaths& paths) {
  Differences<4> corners;
  for (std::size_t k = 0; k < 4; ++k) {
    corners[k] = paths.edge_b[k % 2].begin - paths.edge_a[k / 2].begin;
  }
  return corners;
}

template <typename Paths>
void check(const Paths& paths) {
  const auto corners = differences(paths);
  const auto nearest = find_nearest(corners);
  const double truth = static_cast<double>(testing::path_distance(paths, 0));
  EXPECT_NEAR(nearest.point.norm(), truth, 1e-12);
  // The point is the mean of the corners with the weights, and lies on the element.
  Vector3 mean = Vector3::Zero();
  Scalar sum = 0;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    EXPECT_GE(nearest.weights[k], 0);
    sum += nearest.weights[k];
    mean += nearest.weights[k] * corners[k];
  }
  EXPECT_NEAR(sum, 1, 1e-14);
  EXPECT_NEAR((mean - nearest.point).norm(), 0, 1e-13);
  // Apart, the normal supports at the nearest point: no corner is nearer along it.
  if (truth < 1e-3 || !(nearest.normal.norm() > 1e-6)) return;
  const Vector3 nhat = nearest.normal.normalized();
  for (const Vector3& corner : corners) EXPECT_GE(nhat.dot(corner), truth - 1e-9);
}

TEST(NearestDifference, AgreesWithTheOracleOnAllKindsOfPairs) {
  std::mt19937_64 random(1);
  for (const PathKind kind : testing::kAllPathKinds) {
    for (int i = 0; i < 300; ++i) {
      SCOPED_TRACE("kind " + std::to_string(static_cast<int>(kind)) + " number " +
                   std::to_string(i));
      const FourPaths paths = testing::make_paths(kind, random);
      check(testing::vertex_face(paths));
      check(testing::edge_edge(paths));
    }
  }
}

TEST(NearestDifference, NamesFeatures) {
  const Vector3 p(0.2, 0.2, 1);
  const Differences<3> above{Vector3(0, 0, 0) - p, Vector3(1, 0, 0) - p, Vector3(0, 1, 0) - p};
  EXPECT_EQ(find_nearest(above).feature_b, (Feature{FeatureKind::Face, {0, 1, 2}}));
  const Vector3 q(2, 2, 0);
  const Differences<3> beside{Vector3(0, 0, 0) - q, Vector3(1, 0, 0) - q, Vector3(0, 1, 0) - q};
  EXPECT_EQ(find_nearest(beside).feature_b, (Feature{FeatureKind::Edge, {1, 2}}));
  // Edge A from (0, 0, 0) to (1, 0, 0), edge B from (2, -1, 1) to (2, 1, 1): the end 1 of A is
  // nearest.
  const Differences<4> ends{Vector3(2, -1, 1), Vector3(2, 1, 1), Vector3(1, -1, 1),
                            Vector3(1, 1, 1)};
  EXPECT_EQ(find_nearest(ends).feature_a, (Feature{FeatureKind::Vertex, {1}}));
  EXPECT_EQ(find_nearest(ends).feature_b, (Feature{FeatureKind::Edge, {0, 1}}));
}

TEST(NearestDifference, KeepsItsPointOnThinTriangles) {
  std::mt19937_64 random(2);
  for (int i = 0; i < 2000; ++i) {
    const Scalar width = testing::random_magnitude(-12, 0, random);
    const Vector3 p = testing::random_vector(0.5, random);
    const Vector3 a = testing::random_vector(1, random);
    const Vector3 b = testing::random_vector(1, random);
    const Vector3 c = a + testing::random_number(0, 1, random) * (b - a) +
                      width * testing::random_vector(1, random);
    const VertexFacePaths paths{{p, p}, {VertexPath{a, a}, VertexPath{b, b}, VertexPath{c, c}}};
    const auto nearest = find_nearest(differences(paths));
    const double truth = static_cast<double>(testing::path_distance(paths, 0));
    EXPECT_NEAR(nearest.point.norm(), truth, 1e-6);
    for (const Scalar weight : nearest.weights) EXPECT_GE(weight, 0);
  }
}

}  // namespace
}  // namespace dyop::toi_internal
