#include "motion/bernstein.h"

#include <gtest/gtest.h>

#include <cmath>

#include "motion/random_values.h"

namespace dyop::testing {
namespace {

using internal::Bernstein;

Bernstein<4> random_cubic(Random& random) {
  return {random.in_ball(1), random.in_ball(1), random.in_ball(1), random.in_ball(1)};
}

TEST(Bernstein, CubicHermiteMeetsItsData) {
  Random random(1);
  const Vector3 x0 = random.in_ball(1), v0 = random.in_ball(1);
  const Vector3 x1 = random.in_ball(1), v1 = random.in_ball(1);
  const Bernstein<4> cubic = internal::cubic_hermite(x0, v0, x1, v1, 2.5);
  const Bernstein<3> rate = internal::derivative<4>(cubic, 2.5);
  EXPECT_EQ(internal::evaluate<4>(cubic, 0), x0);
  EXPECT_EQ(internal::evaluate<4>(cubic, 1), x1);
  EXPECT_LT((internal::evaluate<3>(rate, 0) - v0).norm(), 1e-15);
  EXPECT_LT((internal::evaluate<3>(rate, 1) - v1).norm(), 1e-15);
}

// s^3 has the coefficients 0, 0, 0, 1; its derivative 3 s^2 has 0, 0, 3.
TEST(Bernstein, EvaluatesAndDerivesAMonomial) {
  const Bernstein<4> cube = {Vector3::Zero(), Vector3::Zero(), Vector3::Zero(), Vector3::Ones()};
  EXPECT_DOUBLE_EQ(internal::evaluate<4>(cube, 0.5).x(), 0.125);
  EXPECT_DOUBLE_EQ(internal::evaluate<3>(internal::derivative<4>(cube, 1), 0.5).x(), 0.75);
}

TEST(Bernstein, RestrictionIsTheSamePolynomial) {
  Random random(2);
  for (int i = 0; i < 200; ++i) {
    const Bernstein<4> cubic = random_cubic(random);
    const Scalar s0 = random.uniform(0, 1), s1 = random.uniform(s0, 1), s = random.uniform(0, 1);
    const Bernstein<4> part = internal::restrict_to<4>(cubic, s0, s1);
    EXPECT_LT((internal::evaluate<4>(part, s) - internal::evaluate<4>(cubic, (1 - s) * s0 + s * s1))
                  .norm(),
              1e-14);
  }
}

TEST(Bernstein, CrossProductIsTheQuintic) {
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const Bernstein<4> x = random_cubic(random);
    const Bernstein<3> y = {random.in_ball(1), random.in_ball(1), random.in_ball(1)};
    const Bernstein<6> product = internal::cross_product(x, y);
    for (Scalar s = 0; s <= 1; s += 1.0 / 64) {
      const Vector3 expected = internal::evaluate<4>(x, s).cross(internal::evaluate<3>(y, s));
      EXPECT_LT((internal::evaluate<6>(product, s) - expected).norm(), 2e-15);
      EXPECT_LE(expected.norm(), internal::largest_norm<6>(product) * (1 + 1e-14));
    }
  }
}

TEST(Bernstein, LargestNormKeepsNaN) {
  EXPECT_TRUE(
      std::isnan(internal::largest_norm<2>({Vector3(std::nan(""), 0, 0), Vector3::Ones()})));
  EXPECT_TRUE(
      std::isnan(internal::largest_norm<2>({Vector3::Ones(), Vector3(0, std::nan(""), 0)})));
}

}  // namespace
}  // namespace dyop::testing
