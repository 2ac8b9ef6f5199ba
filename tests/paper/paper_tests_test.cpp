// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "dyop/distance/triangle_distance.h"
#include "dyop/paper/planar_distance.h"
#include "paper/experiment/paper_experiment.h"

namespace dyop::cli {
namespace {

Scalar distance_of(const PaperPair<2>& pair) {
  return planar_triangle_distance(pair.a, pair.b).upper;
}
Scalar distance_of(const PaperPair<3>& pair) {
  return triangle_distance(pair.a, pair.b).upper;
}

template <typename Dimension>
class PaperTests : public ::testing::Test {};

template <int dimension>
struct InDimension {
  static constexpr int value = dimension;
};
using Dimensions = ::testing::Types<InDimension<2>, InDimension<3>>;
TYPED_TEST_SUITE(PaperTests, Dimensions);

TYPED_TEST(PaperTests, EveryObjectMeetsTheNineOthersAtTheGap) {
  const auto tests = make_paper_tests<TypeParam::value>(5);
  ASSERT_EQ(tests.size(), 90u);
  for (std::size_t k = 0; k < tests.size(); ++k) {
    EXPECT_EQ(tests[k].object, int(k) / 9 + 1);
    EXPECT_NE(tests[k].object, tests[k].against);
    EXPECT_NEAR(distance_of(tests[k].pair), kPaperGap, 1e-12);
  }
}

TYPED_TEST(PaperTests, ATurnedCopyIsAnotherInputAtTheSameDistance) {
  std::mt19937_64 random(6);
  for (const auto& test : make_paper_tests<TypeParam::value>(5)) {
    const auto copy = rotated_copy(test.pair, random);
    EXPECT_NEAR(distance_of(copy), kPaperGap, 1e-12);
    EXPECT_NE(copy.b[0], test.pair.b[0]);
    EXPECT_NE(rotated_copy(test.pair, random).b[0], copy.b[0]);
  }
}

TYPED_TEST(PaperTests, APathComesNearerAndEndsAtTheGap) {
  std::mt19937_64 random(7);
  for (const auto& test : make_paper_tests<TypeParam::value>(5)) {
    std::vector<PaperPair<TypeParam::value>> path;
    append_path(test, 16, random, path);
    ASSERT_EQ(path.size(), 16u);
    EXPECT_NEAR(distance_of(path.back()), kPaperGap, 1e-12);
    EXPECT_GT(distance_of(path.front()), kPaperGap);
    // A step is 1/16 of a unit and of a radian, and no vertex is farther than 2 from the centroid.
    for (std::size_t k = 1; k < path.size(); ++k) {
      EXPECT_LT(std::abs(distance_of(path[k]) - distance_of(path[k - 1])), 3.0 / 16);
    }
  }
}

}  // namespace
}  // namespace dyop::cli
