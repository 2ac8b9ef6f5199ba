// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "core/tolerance.h"
#include "dyop/distance/triangle_distance.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/triangle_distance_check.h"

namespace dyop::testing {
namespace {

// Every feature a triangle has, and some that it has not.
std::vector<Feature> all_features() {
  std::vector<Feature> features{{}, {FeatureKind::Face, {0, 1, 2}}, {FeatureKind::Edge, {1, 7}}};
  for (std::int32_t k = 0; k < 3; ++k) {
    const std::int32_t next = (k + 1) % 3;
    features.push_back({FeatureKind::Vertex, {k}});
    features.push_back({FeatureKind::Edge, {k, next}});
    features.push_back({FeatureKind::Edge, {next, k}});
  }
  features.push_back({FeatureKind::Vertex, {-1}});
  return features;
}

TEST(WarmTriangleDistance, AnyStartKeepsEveryPromiseInEveryFamily) {
  std::mt19937_64 random(51);
  const std::vector<Feature> features = all_features();
  for (const TriangleFamily family : kAllTriangleFamilies) {
    for (int k = 0; k < 400; ++k) {
      const TrianglePair pair = random_triangle_pair(family, random);
      const OracleDistance truth = oracle_triangle_distance(pair.a, pair.b);
      const auto any = [&]() -> const Feature& {
        return features[std::size_t(random_index(int(features.size()), random))];
      };
      const TriangleDistance d = warm_triangle_distance(pair.a, pair.b, any(), any());
      const char* broken = broken_bound(pair.a, pair.b, d, truth);
      ASSERT_EQ(broken, nullptr) << name_of(family) << ' ' << k;
      broken = broken_witness(pair.a, pair.b, d);
      ASSERT_EQ(broken, nullptr) << name_of(family) << ' ' << k;
    }
  }
}

TEST(WarmTriangleDistance, TheLastFeaturesAreFoundAgain) {
  std::mt19937_64 random(52);
  int same = 0;
  constexpr int kPairs = 2000;
  for (int k = 0; k < kPairs; ++k) {
    TrianglePair pair = random_triangle_pair(TriangleFamily::Near, random);
    const TriangleDistance cold = triangle_distance(pair.a, pair.b);
    for (Vector3& p : pair.b) p += 1e-6 * cold.nhat_AB;  // literal: a small step
    const TriangleDistance warm =
        warm_triangle_distance(pair.a, pair.b, cold.feature_a, cold.feature_b);
    same += warm.feature_a == cold.feature_a && warm.feature_b == cold.feature_b;
  }
  EXPECT_GT(same, kPairs * 95 / 100);
}

}  // namespace
}  // namespace dyop::testing
