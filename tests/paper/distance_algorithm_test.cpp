// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/paper/distance_algorithm.h"

#include <gtest/gtest.h>

#include <numbers>
#include <set>
#include <vector>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "planar_pairs.h"
#include "support/message_of.h"
#include "support/oracles/polytope_oracle.h"

/// What every algorithm promises, run over all of distance_algorithms().
namespace dyop::testing {
namespace {

// Estimates are wanted to be this accurate, relative to the size of the pair, wherever the
// algorithm is exact in exact arithmetic; published DyOP is not, and is only held to be no
// under-estimate.
constexpr Scalar kEstimateNoise = 1e-9;  // literal: textbook GJK stops at 1e-12 of the distance

// Published DyOP is exact nowhere, and knows no crossing in space.
bool is_heuristic(const DistanceAlgorithm& algorithm) {
  return algorithm.name() == "published DyOP";
}

class DistanceAlgorithmContract : public ::testing::TestWithParam<const DistanceAlgorithm*> {
 protected:
  const DistanceAlgorithm& algorithm() const { return *GetParam(); }
};

// What only some promise: each suite runs over all of distance_algorithms() that do.
class CertifiedDistanceAlgorithm : public DistanceAlgorithmContract {};
class ExactDistanceAlgorithm : public DistanceAlgorithmContract {};
class HullDistanceAlgorithm : public DistanceAlgorithmContract {};

// Largest distance of two vertices, and of a vertex from the origin: GJK's rounding grows with it.
template <typename AnyTriangle>
Scalar size_of(const AnyTriangle& a, const AnyTriangle& b) {
  Scalar size = 0;
  for (const auto& p : a) size = std::max(size, p.norm());
  for (const auto& p : b) size = std::max(size, p.norm());
  return 2 * size;
}

// Whether the answer keeps what the algorithm promises.
bool is_kept(const DistanceAlgorithm& algorithm, const DistanceBounds& d,
             const OracleDistance& truth, Scalar size) {
  const Scalar noise = kEstimateNoise * size;
  const auto wide = [](Scalar x) { return static_cast<long double>(x); };
  if (algorithm.is_certified()) {
    return wide(d.lower) <= truth.upper() && wide(d.upper) >= truth.lower() &&
           d.upper - d.lower <= noise;
  }
  const bool is_no_less = d.lower == 0 && wide(d.upper + noise) >= truth.lower();
  return is_no_less && (is_heuristic(algorithm) || wide(d.upper - noise) <= truth.upper());
}

// Proofs hold always. Of estimates one in 500 may be lost in rounding: libccd's are, now and then.
int failures_allowed(const DistanceAlgorithm& algorithm, int checked) {
  return algorithm.is_certified() ? 0 : checked / 500;
}

TEST_P(DistanceAlgorithmContract, HoldsInThePlaneAtAnyScale) {
  std::mt19937_64 random(11);
  int failures = 0;
  for (int k = 0; k < 4000; ++k) {
    const Scalar scale = random_magnitude(-4, 4, random);
    const Vector2 offset = random_planar_vector(10 * scale, random);
    const PlanarPair pair = random_planar_pair(PlanarFamily::Apart, scale, offset, random);
    const OracleDistance truth = oracle_distance(pair);
    const Scalar size = size_of(pair.a, pair.b);
    for (const DistanceBounds& d :
         {algorithm().distance(pair.a, pair.b), algorithm().distance(pair.b, pair.a)}) {
      failures += !is_kept(algorithm(), d, truth, size);
    }
  }
  EXPECT_LE(failures, failures_allowed(algorithm(), 8000));
}

TEST_P(DistanceAlgorithmContract, HoldsInSpaceAtAnyScale) {
  std::mt19937_64 random(12);
  int separated = 0;
  int failures = 0;
  for (int k = 0; k < 4000; ++k) {
    TrianglePair pair =
        random_triangle_pair(k % 8 == 0 ? TriangleFamily::Far : TriangleFamily::Near, random);
    const Scalar scale = random_magnitude(-4, 4, random);
    const Vector3 offset = random_vector(10 * scale, random);
    for (Triangle* t : {&pair.a, &pair.b}) {
      for (Vector3& p : *t) p = scale * p + offset;
    }
    const OracleDistance truth = oracle_triangle_distance(pair.a, pair.b);
    const Scalar size = size_of(pair.a, pair.b);
    // Estimates may miss a touching by rounding; a hundredth of a percent of the size is apart
    // enough.
    const bool is_apart = truth.lower() > static_cast<long double>(size) / 10000;
    separated += is_apart;
    if (!is_apart && !algorithm().is_certified()) continue;
    for (const DistanceBounds& d :
         {algorithm().distance(pair.a, pair.b), algorithm().distance(pair.b, pair.a)}) {
      failures += !is_kept(algorithm(), d, truth, size);
    }
  }
  EXPECT_LE(failures, failures_allowed(algorithm(), 2 * separated));
  EXPECT_GT(separated, 1000);
}

TEST_P(CertifiedDistanceAlgorithm, BoundsSurviveEveryFamily) {
  std::mt19937_64 random(13);
  for (const TriangleFamily family : kAllTriangleFamilies) {
    for (int k = 0; k < 300; ++k) {
      const TrianglePair pair = random_triangle_pair(family, random);
      const OracleDistance truth = oracle_triangle_distance(pair.a, pair.b);
      const DistanceBounds d = algorithm().distance(pair.a, pair.b);
      ASSERT_GE(d.lower, 0) << name_of(family);
      ASSERT_LE(static_cast<long double>(d.lower), truth.upper()) << name_of(family);
      ASSERT_GE(static_cast<long double>(d.upper), truth.lower()) << name_of(family);
    }
  }
  for (const PlanarFamily family : kAllPlanarFamilies) {
    for (int k = 0; k < 300; ++k) {
      const PlanarPair pair = random_planar_pair(family, 1, Vector2::Zero(), random);
      const OracleDistance truth = oracle_distance(pair);
      const DistanceBounds d = algorithm().distance(pair.a, pair.b);
      ASSERT_LE(static_cast<long double>(d.lower), truth.upper());
      ASSERT_GE(static_cast<long double>(d.upper), truth.lower());
    }
  }
}

TEST_P(ExactDistanceAlgorithm, CrossingTrianglesAreNotApart) {
  const Triangle a{Vector3(-1, -1, 0), Vector3(1, -1, 0), Vector3(0, 2, 0)};
  const Triangle b{Vector3(0, 0, -1), Vector3(0, 0, 1), Vector3(3, 0, 0.5)};
  const DistanceBounds d = algorithm().distance(a, b);
  EXPECT_EQ(d.lower, 0);
  EXPECT_LE(d.upper, kEstimateNoise);
}

TEST_P(HullDistanceAlgorithm, KeepsTheBoundsForHullsOfManyPoints) {
  std::mt19937_64 random(14);
  for (int k = 0; k < 12; ++k) {
    std::vector<Vector3> points_a, points_b;
    for (int i = 0; i < 9; ++i) {
      points_a.push_back(random_vector(1, random));
      points_b.push_back(random_vector(1, random));
    }
    const RigidPose X_AB(random_rotation(random), 2.2 * random_direction(random));
    const auto d = algorithm().distance(ConvexHull(points_a), ConvexHull(points_b), X_AB);
    ASSERT_TRUE(d);
    const testing::PointHull a(points_a), b(points_b);
    const auto truth = testing::PolytopeOracle(a, b, X_AB).core_distance();
    EXPECT_LE(static_cast<long double>(d->lower), truth);
    EXPECT_GE(static_cast<long double>(d->upper), truth);
    EXPECT_LE(d->upper - d->lower, kEstimateNoise);
  }
}

template <typename Condition>
std::vector<const DistanceAlgorithm*> all_that(const Condition& condition) {
  std::vector<const DistanceAlgorithm*> algorithms;
  for (const DistanceAlgorithm* algorithm : distance_algorithms()) {
    if (condition(*algorithm)) algorithms.push_back(algorithm);
  }
  return algorithms;
}

bool takes_hulls(const DistanceAlgorithm& algorithm) {
  const ConvexHull hull({Vector3::Zero(), Vector3::UnitX(), Vector3::UnitY(), Vector3::UnitZ()});
  return algorithm.distance(hull, hull, RigidPose(Vector3(3, 0, 0))).has_value();
}

std::string test_name(const ::testing::TestParamInfo<const DistanceAlgorithm*>& test) {
  std::string name;
  for (const char c : test.param->name()) {
    if (std::isalnum(static_cast<unsigned char>(c))) name += c;
  }
  return name;
}

INSTANTIATE_TEST_SUITE_P(All, DistanceAlgorithmContract,
                         ::testing::ValuesIn(distance_algorithms().begin(),
                                             distance_algorithms().end()),
                         test_name);
INSTANTIATE_TEST_SUITE_P(All, CertifiedDistanceAlgorithm,
                         ::testing::ValuesIn(all_that([](const DistanceAlgorithm& algorithm) {
                           return algorithm.is_certified();
                         })),
                         test_name);
INSTANTIATE_TEST_SUITE_P(All, ExactDistanceAlgorithm,
                         ::testing::ValuesIn(all_that([](const DistanceAlgorithm& algorithm) {
                           return !is_heuristic(algorithm);
                         })),
                         test_name);
INSTANTIATE_TEST_SUITE_P(All, HullDistanceAlgorithm, ::testing::ValuesIn(all_that(takes_hulls)),
                         test_name);

// So that no suite above is empty, or shrinks unnoticed.
TEST(DistanceAlgorithms, AreTestedForAllThatTheyPromise) {
  const auto is_certified = [](const DistanceAlgorithm& x) { return x.is_certified(); };
  EXPECT_EQ(all_that(is_certified).size(), 3u);
  EXPECT_EQ(all_that(is_heuristic).size(), 1u);
  EXPECT_EQ(all_that(takes_hulls).size(), 2u);
}

TEST(DistanceAlgorithms, HaveNamesOfTheirOwn) {
  std::set<std::string_view> names;
  for (const DistanceAlgorithm* algorithm : distance_algorithms()) {
    EXPECT_TRUE(names.insert(algorithm->name()).second) << algorithm->name();
    EXPECT_EQ(&distance_algorithm(algorithm->name()), algorithm);
  }
  EXPECT_EQ(distance_algorithms()[0]->name(), "certified DyOP");
}

TEST(DistanceAlgorithms, AnUnknownNameIsAnsweredWithThoseThatExist) {
  const std::string message = testing::message_of([] { distance_algorithm("V-Clip"); });
  EXPECT_NE(message.find("V-Clip"), std::string::npos) << message;
  EXPECT_NE(message.find("Lin-Canny"), std::string::npos) << message;
}

}  // namespace
}  // namespace dyop::testing
