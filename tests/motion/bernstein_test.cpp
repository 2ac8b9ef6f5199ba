// SPDX-License-Identifier: BSD-3-Clause
#include "motion/curve/bernstein.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "motion/random_values.h"

namespace dyop::testing {
namespace {

using motion_internal::BernsteinSpan;

std::vector<Vector3> random_polynomial(Random& random, std::size_t degree) {
  std::vector<Vector3> b;
  for (std::size_t i = 0; i <= degree; ++i) b.push_back(random.in_ball(1));
  return b;
}

// By the definition: the sum of C(n, k) s^k (1 - s)^(n - k) b_k.
Vector3 by_definition(const std::vector<Vector3>& b, Scalar s) {
  const Scalar n = static_cast<Scalar>(b.size() - 1);
  Vector3 sum = Vector3::Zero();
  for (std::size_t i = 0; i < b.size(); ++i) {
    const Scalar k = static_cast<Scalar>(i);
    const Scalar choices = std::tgamma(n + 1) / (std::tgamma(k + 1) * std::tgamma(n - k + 1));
    sum += choices * std::pow(s, k) * std::pow(1 - s, n - k) * b[i];
  }
  return sum;
}

TEST(Bernstein, EvaluatesTheDefinitionForEveryDegree) {
  Random random(1);
  for (std::size_t degree = 0; degree <= 9; ++degree) {
    const std::vector<Vector3> b = random_polynomial(random, degree);
    for (Scalar s = 0; s <= 1; s += 1.0 / 16) {
      EXPECT_LT((motion_internal::evaluate(b, s) - by_definition(b, s)).norm(), 1e-14) << degree;
    }
  }
}

TEST(Bernstein, RestrictionIsTheSamePolynomial) {
  Random random(2);
  for (int i = 0; i < 200; ++i) {
    const std::vector<Vector3> b = random_polynomial(random, static_cast<std::size_t>(i % 10));
    const Scalar s0 = random.uniform(0, 1), s1 = random.uniform(s0, 1), s = random.uniform(0, 1);
    std::vector<Vector3> part(b.size());
    motion_internal::restrict_to(b, s0, s1, part);
    EXPECT_LT((by_definition(part, s) - by_definition(b, (1 - s) * s0 + s * s1)).norm(), 1e-13);
    motion_internal::restrict_to(b, 0, 1, part);
    EXPECT_EQ(part, b);
  }
}

TEST(Bernstein, DerivativeIsTheLimitOfDifferences) {
  Random random(3);
  for (std::size_t degree = 1; degree <= 9; ++degree) {
    const std::vector<Vector3> b = random_polynomial(random, degree);
    std::vector<Vector3> rate(degree);
    motion_internal::derive(b, 2.5, rate);
    const Scalar step = 1e-5;
    const Vector3 difference = (by_definition(b, 0.3 + step) - by_definition(b, 0.3 - step));
    EXPECT_LT((motion_internal::evaluate(rate, 0.3) - difference / (2 * step * 2.5)).norm(), 1e-7);
  }
}

// s^3 has the coefficients 0, 0, 0, 1; its derivative 3 s^2 has 0, 0, 3.
TEST(Bernstein, EvaluatesAndDerivesAMonomial) {
  const std::vector<Vector3> cube = {Vector3::Zero(), Vector3::Zero(), Vector3::Zero(),
                                     Vector3::Ones()};
  std::vector<Vector3> rate(3);
  motion_internal::derive(cube, 1, rate);
  EXPECT_DOUBLE_EQ(motion_internal::evaluate(cube, 0.5).x(), 0.125);
  EXPECT_DOUBLE_EQ(motion_internal::evaluate(rate, 0.5).x(), 0.75);
}

// Every value of x(s) x y(s) is below the largest coefficient, which is attained for constants.
TEST(Bernstein, BoundsTheCrossProduct) {
  Random random(4);
  for (int i = 0; i < 200; ++i) {
    const std::vector<Vector3> x = random_polynomial(random, static_cast<std::size_t>(i % 10));
    const std::vector<Vector3> y = random_polynomial(random, static_cast<std::size_t>(i % 7));
    const Scalar bound = motion_internal::largest_cross_product(x, y);
    for (Scalar s = 0; s <= 1; s += 1.0 / 64) {
      const Scalar value = by_definition(x, s).cross(by_definition(y, s)).norm();
      ASSERT_LE(value, bound * (1 + 1e-14));
      if (x.size() == 1 && y.size() == 1) {
        EXPECT_NEAR(value, bound, 1e-15);
      }
    }
  }
}

// s (1, 0, 0) and s (0, 1, 0) have the product s^2 (0, 0, 1), whose coefficients are 0, 0, 1.
TEST(Bernstein, CrossProductOfLinesIsExact) {
  const std::vector<Vector3> x = {Vector3::Zero(), Vector3::UnitX()};
  const std::vector<Vector3> y = {Vector3::Zero(), Vector3::UnitY()};
  EXPECT_EQ(motion_internal::largest_cross_product(x, y), 1);
}

TEST(Bernstein, LargestNormKeepsNaNAndOfNothingIsZero) {
  EXPECT_EQ(motion_internal::largest_norm(BernsteinSpan()), 0);
  const Vector3 not_a_number(0, std::nan(""), 0);
  const std::vector<Vector3> first = {not_a_number, Vector3::Ones()};
  const std::vector<Vector3> last = {Vector3::Ones(), not_a_number};
  EXPECT_TRUE(std::isnan(motion_internal::largest_norm(first)));
  EXPECT_TRUE(std::isnan(motion_internal::largest_norm(last)));
}

TEST(Bernstein, LargestNormSurvivesSquaresThatUnderflow) {
  const std::vector<Vector3> b = {Vector3(3e-170, 4e-170, 0), Vector3::Zero()};
  EXPECT_NEAR(motion_internal::largest_norm(b), 5e-170, 1e-185);
}

}  // namespace
}  // namespace dyop::testing
