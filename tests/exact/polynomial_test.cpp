// SPDX-License-Identifier: BSD-3-Clause
#include "exact/polynomial.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace dyop::exact_internal {
namespace {

ExactPolynomial polynomial(std::int64_t c0, std::int64_t c1, std::int64_t c2 = 0,
                           std::int64_t c3 = 0) {
  return {{c0, c1, c2, c3}};
}

// (d s - n), with the root n / d.
ExactPolynomial linear_factor(std::int64_t n, std::int64_t d) {
  return polynomial(-n, d);
}

TEST(ExactPolynomial, FindsEveryFractionOnce) {
  // Products of linear factors n / d: the distinct ones in [0, 1] are known.
  std::mt19937_64 random(1);
  for (int i = 0; i < 4000; ++i) {
    ExactPolynomial p = polynomial(1, 0);
    std::vector<std::pair<std::int64_t, std::int64_t>> expected;
    const int degree = 1 + static_cast<int>(random() % 3);
    for (int k = 0; k < degree; ++k) {
      const auto n = static_cast<std::int64_t>(random() % 13) - 3;
      const auto d = static_cast<std::int64_t>(random() % 7) + 1;
      p = p * linear_factor(n, d);
      const bool is_known = std::any_of(expected.begin(), expected.end(), [&](const auto& other) {
        return other.first * d == other.second * n;
      });
      if (n >= 0 && n <= d && !is_known) expected.emplace_back(n, d);
    }
    std::vector<ExactRoot> roots = roots_in_unit_interval(p);
    ASSERT_EQ(roots.size(), expected.size());
    for (const auto& [n, d] : expected) {
      // Exactly one of the roots is this one.
      EXPECT_EQ(std::count_if(roots.begin(), roots.end(),
                              [&, n = n, d = d](ExactRoot& root) {
                                return sign_at(linear_factor(n, d), p, root) == 0;
                              }),
                1);
    }
  }
}

TEST(ExactPolynomial, IsolatesRootsThatAreNoFractions) {
  // 2 s^2 - 1: the root is 1 / sqrt(2) = 0.70710678...
  const ExactPolynomial p = polynomial(-1, 0, 2);
  std::vector<ExactRoot> roots = roots_in_unit_interval(p);
  ASSERT_EQ(roots.size(), 1u);
  EXPECT_EQ(sign_at(linear_factor(70710678, 100000000), p, roots[0]), 1);
  EXPECT_EQ(sign_at(linear_factor(70710679, 100000000), p, roots[0]), -1);
  EXPECT_EQ(sign_at(polynomial(-3, 0, 6), p, roots[0]), 0) << "a multiple of p";
  EXPECT_EQ(sign_at(polynomial(0, 0, 0), p, roots[0]), 0) << "the zero polynomial";
  EXPECT_EQ(sign_at(polynomial(-5, 0), p, roots[0]), -1) << "a constant";
}

TEST(ExactPolynomial, TellsCommonRootsFromNearOnes) {
  // p = (2 s^2 - 1)(s + 1), and q whose root is off by about 2^-40.
  const ExactPolynomial p = polynomial(-1, 0, 2) * polynomial(1, 1);
  std::vector<ExactRoot> roots = roots_in_unit_interval(p);
  ASSERT_EQ(roots.size(), 1u);
  EXPECT_EQ(sign_at(polynomial(-1, 0, 2), p, roots[0]), 0);
  const std::int64_t large = std::int64_t{1} << 40;
  EXPECT_EQ(sign_at(polynomial(-large - 1, 0, 2 * large), p, roots[0]), -1);
  EXPECT_EQ(sign_at(polynomial(-large + 1, 0, 2 * large), p, roots[0]), 1);
  // A quadratic with one common root that is no divisor of p: (s - 1/2) p0 has degree three, so
  // take the linear case: q vanishes at 1 / 2, p does not.
  EXPECT_NE(sign_at(linear_factor(1, 2), p, roots[0]), 0);
}

TEST(ExactPolynomial, AgreesWithLongDoubleAwayFromTies) {
  std::mt19937_64 random(2);
  const auto coefficient = [&] { return static_cast<std::int64_t>(random() % 101) - 50; };
  int compared = 0;
  for (int i = 0; i < 3000; ++i) {
    const std::array<std::int64_t, 4> c{coefficient(), coefficient(), coefficient(), coefficient()};
    const std::array<std::int64_t, 3> e{coefficient(), coefficient(), coefficient()};
    const ExactPolynomial p = polynomial(c[0], c[1], c[2], c[3]);
    const ExactPolynomial q = polynomial(e[0], e[1], e[2]);
    if (p.is_zero()) continue;
    const auto value = [](const auto& coefficients, long double s) {
      long double sum = 0;
      for (std::size_t k = coefficients.size(); k-- > 0;) {
        sum = sum * s + static_cast<long double>(coefficients[k]);
      }
      return sum;
    };
    // Roots by a scan with bisection; pairs within a cell of the scan are rare and not compared.
    std::vector<long double> found;
    constexpr int kCells = 500;
    for (int cell = 0; cell < kCells; ++cell) {
      long double begin = (cell + 0.25L) / (kCells + 1);
      long double end = (cell + 1.25L) / (kCells + 1);
      if (value(c, begin) * value(c, end) >= 0) continue;
      for (int step = 0; step < 80; ++step) {
        const long double middle = (begin + end) / 2;
        (value(c, begin) * value(c, middle) <= 0 ? end : begin) = middle;
      }
      found.push_back(begin);
    }
    std::vector<ExactRoot> roots = roots_in_unit_interval(p);
    if (roots.size() != found.size()) continue;
    std::vector<int> signs;
    std::vector<int> expected;
    bool is_tie = false;
    for (std::size_t k = 0; k < roots.size(); ++k) {
      signs.push_back(sign_at(q, p, roots[k]));
      const long double at_root = value(e, found[k]);
      is_tie = is_tie || std::abs(at_root) < 1e-9L;
      expected.push_back(at_root > 0 ? 1 : -1);
    }
    if (is_tie) continue;
    std::sort(signs.begin(), signs.end());
    std::sort(expected.begin(), expected.end());
    EXPECT_EQ(signs, expected);
    ++compared;
  }
  EXPECT_GT(compared, 2700);
}

}  // namespace
}  // namespace dyop::exact_internal
