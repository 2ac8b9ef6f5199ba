// SPDX-License-Identifier: BSD-3-Clause
#include "tissue/point_compliance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <random>

#include "support/inputs/random_inputs.h"
#include "support/inputs/tissue_bars.h"

namespace dyop::tissue_internal {
namespace {

// A bar, fixed at an end and bent.
struct BentBar {
  BentBar() : arrays(testing::divided_box({6, 2, 2}, {6, 2, 2})), tissue(arrays.mesh(), options()) {
    for (int k = 0; k < 20; ++k) tissue.step({});
  }
  static SoftTissueOptions options() {
    SoftTissueOptions options;
    options.material = {1, 0.3, 1, 0.1, 0.05};
    options.cube_edge = 0.7;
    options.period = 0.1;
    options.gravity_W = Vector3(0, 0.01, -0.03);
    options.fixed.emplace_back(Vector3(-1, -1, -1), Vector3(0.1, 3, 3));
    return options;
  }

  TissueBody& body() { return body_of(tissue); }
  CarriedPoint random_point(std::mt19937_64& random) {
    Vector3 weights;
    for (Scalar& weight : weights) weight = testing::random_number(0, 1, random);
    const auto triangle =
        std::int32_t(testing::random_number(0, 1, random) * double(arrays.triangles.size()));
    return body().carried_point(triangle, weights / weights.sum());
  }

  testing::MeshArrays arrays;
  SoftTissue tissue;
};

// Against the factor's answer to the impulses on all nodes at once.
TEST(PointCompliance, AnswersLikeThePreconditioner) {
  BentBar bar;
  TissueBody& body = bar.body();
  body.prepare_response();
  PointCompliance compliance(body);
  std::mt19937_64 random(1);
  std::vector<CarriedPoint> points;
  Scalar largest = 0;
  for (std::size_t k = 0; k < 12; ++k) {
    points.push_back(bar.random_point(random));
    const CarriedPoint* added = &points.back();
    compliance.prepare(std::span(&added, 1));
    const std::span<const Matrix3> blocks = compliance.add(points.back());
    ASSERT_EQ(blocks.size(), k + 1);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      NodeVectors impulses = NodeVectors::Zero(3, body.positions().cols());
      TissueBody::add_impulse(points.back(), Vector3::Unit(axis), impulses);
      const NodeVectors v = body.precondition(impulses);
      for (std::size_t i = 0; i <= k; ++i) {
        const Vector3 expected = TissueBody::sum_of(points[i], v);
        largest = std::max(largest, expected.norm());
        EXPECT_LE((blocks[i].col(axis) - expected).norm(), 1e-5 * largest) << i << ' ' << k;
      }
    }
  }
}

TEST(PointCompliance, AddsVelocitiesLikeThePreconditioner) {
  BentBar bar;
  TissueBody& body = bar.body();
  body.prepare_response();
  std::mt19937_64 random(2);
  NodeVectors impulses = NodeVectors::Zero(3, body.positions().cols());
  std::vector<std::int32_t> nodes;
  for (int k = 0; k < 5; ++k) {
    const CarriedPoint point = bar.random_point(random);
    TissueBody::add_impulse(point, testing::random_direction(random), impulses);
    std::copy_if(point.nodes.begin(), point.nodes.end(), std::back_inserter(nodes),
                 [&](std::int32_t n) { return body.is_free(n); });
  }
  const NodeVectors expected = body.precondition(impulses);
  NodeVectors v = NodeVectors::Zero(3, impulses.cols());
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  body.add_response(impulses, nodes, v);
  for (const std::int32_t n : nodes) {
    EXPECT_LE((v.col(n) - expected.col(n)).norm(), 1e-5 * expected.norm());
  }
}

// As after a cut: impulses on nodes that do not carry the surface.
TEST(PointCompliance, AddsVelocitiesOfImpulsesInside) {
  BentBar bar;
  TissueBody& body = bar.body();
  body.prepare_response();
  std::mt19937_64 random(3);
  NodeVectors impulses = NodeVectors::Zero(3, body.positions().cols());
  for (Eigen::Index n = 0; n < impulses.cols(); ++n) {
    if (body.is_free(std::int32_t(n))) impulses.col(n) = testing::random_direction(random);
  }
  NodeVectors v = NodeVectors::Zero(3, impulses.cols());
  const std::vector<std::int32_t> nodes = bar.random_point(random).nodes;
  body.add_response(impulses, nodes, v);
  const NodeVectors expected = body.precondition(impulses);
  for (const std::int32_t n : nodes) {
    EXPECT_LE((v.col(n) - expected.col(n)).norm(), 1e-5 * expected.norm());
  }
}

}  // namespace
}  // namespace dyop::tissue_internal
