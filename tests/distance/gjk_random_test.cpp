// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <random>
#include <vector>

#include "core/tolerance.h"
#include "dyop/distance/gjk.h"
#include "dyop/geometry/convex_hull.h"
#include "support/oracles/polytope_oracle.h"

namespace dyop {
namespace {

using testing::make_box;
using testing::make_capsule;
using testing::make_sphere;
using testing::PointHull;

Scalar pair_size(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB) {
  return X_AB.translation().norm() + a.bounding_radius() + b.bounding_radius();
}

// Random pairs over sizes, size ratios, gaps and kinds, a third of them aligned with the axes.
class RandomPairs {
 public:
  explicit RandomPairs(std::uint64_t seed, int most_points) : rng_(seed), most_(most_points) {}

  struct Pair {
    PointHull a;
    PointHull b;
    RigidPose X_AB;
  };

  Pair next() {
    const Scalar size = std::pow(10, uniform(-4, 4));
    const Scalar ratio = below(4) == 0 ? std::pow(10, uniform(-6, 6)) : 1;
    PointHull a = shape(size);
    PointHull b = shape(size * ratio);
    const bool is_aligned = below(3) == 0;
    Matrix3 R_AB = rotation_from_vector(unit() * uniform(0, 3));
    Vector3 nhat = unit();
    if (is_aligned) {
      R_AB.setIdentity();
      if (below(2) == 0) R_AB << 0, 0, -1, 0, -1, 0, -1, 0, 0;
      nhat = Vector3::Unit(below(3));
    }
    // The slab gap along nhat is `gap`.
    Vector3 p_AB =
        a.support(nhat) + nhat * gap(size, ratio) - R_AB * b.support(-(R_AB.transpose() * nhat));
    if (is_aligned && below(2) == 0) {
      const Vector3 shift = unit() * size * 0.5;
      p_AB += shift - nhat * nhat.dot(shift);
    }
    return {std::move(a), std::move(b), RigidPose(R_AB, p_AB)};
  }

  Scalar uniform(Scalar low, Scalar high) {
    return std::uniform_real_distribution<Scalar>(low, high)(rng_);
  }
  int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(rng_); }
  Vector3 unit() {
    std::normal_distribution<Scalar> normal;
    return Vector3(normal(rng_), normal(rng_), normal(rng_)).normalized();
  }

 private:
  Scalar gap(Scalar size, Scalar ratio) {
    switch (below(6)) {
      case 0:
        return 0;
      case 1:
        return -uniform(0, 1) * size * std::min<Scalar>(1, ratio);
      case 2:
        return size * std::pow(10, uniform(-14, -6));
      case 3:
        return size * std::pow(10, uniform(-6, 0));
      case 4:
        return size * uniform(1, 100);
      default:
        return size * 1e6;
    }
  }

  PointHull shape(Scalar s) {
    switch (below(7)) {
      case 0:
        return make_box(s * Vector3(uniform(0.1, 1), uniform(0.1, 1), uniform(0.1, 1)));
      case 1:
        return make_box(s * Vector3(1, 1e-4, uniform(0.1, 1)));
      case 2:
        return cloud(4 + below(most_ - 3), s, Vector3::Zero());
      case 3:
        return make_capsule(s * uniform(0.1, 1), s * uniform(0.05, 0.5));
      case 4:
        return make_sphere(s * uniform(0.1, 1));
      case 5:
        return cloud(3, s, 1e3 * s * unit());
      default:
        return sliver(s);
    }
  }

  PointHull cloud(int count, Scalar s, const Vector3& center) {
    std::vector<Vector3> points;
    for (int i = 0; i < count; ++i) points.push_back(center + s * unit());
    return PointHull(std::move(points));
  }

  PointHull sliver(Scalar s) {
    const Vector3 p = s * unit();
    const Vector3 q = s * unit();
    return PointHull({p, q, (p + q) / 2 + s * 1e-7 * unit()});
  }

  std::mt19937_64 rng_;
  int most_;
};

TEST(Gjk, BoundsEncloseTheOraclesDistance) {
  RandomPairs pairs(42, 8);
  int separated = 0;
  const int count = 2000;
  for (int i = 0; i < count; ++i) {
    const auto [a, b, X_AB] = pairs.next();
    const GjkResult r = gjk_distance(a, b, X_AB);
    const long double core = testing::PolytopeOracle(a, b, X_AB).core_distance();
    const auto radii = static_cast<long double>(a.rounding_radius() + b.rounding_radius());
    const long double d = std::max(0.0L, core - radii);
    ASSERT_LE(r.lower, d) << "pair " << i;
    ASSERT_GE(r.upper, d) << "pair " << i;
    const Scalar noise = kPoseNoise * pair_size(a, b, X_AB);
    if (r.is_overlapping) {
      ASSERT_LE(d, 2 * noise) << "pair " << i;
    } else if (d > 0) {
      ASSERT_LE(r.upper - r.lower, 64 * noise) << "pair " << i;
    }
    if (r.lower > 0) ++separated;
  }
  // The sample is about both outcomes.
  EXPECT_GT(separated, count * 0.3);
  EXPECT_LT(separated, count * 0.9);
}

// DYOP_GJK_PAIRS sets another number of pairs.
TEST(Gjk, BoundsMeetUpToNoise) {
  const char* asked = std::getenv("DYOP_GJK_PAIRS");
  const int count = asked != nullptr ? std::stoi(asked) : 50000;
  RandomPairs pairs(7, 64);
  std::vector<Scalar> gaps;
  int overlapping = 0;
  int inconclusive = 0;
  int most_iterations = 0;
  std::int64_t all_iterations = 0;
  for (int i = 0; i < count; ++i) {
    const auto [a, b, X_AB] = pairs.next();
    const GjkResult r = gjk_distance(a, b, X_AB);
    ASSERT_LE(r.lower, r.upper);
    all_iterations += r.iterations;
    most_iterations = std::max(most_iterations, r.iterations);
    if (r.is_overlapping) {
      ++overlapping;
      continue;
    }
    if (!(r.lower > 0)) ++inconclusive;
    gaps.push_back((r.upper - r.lower) / pair_size(a, b, X_AB));
  }
  std::sort(gaps.begin(), gaps.end());
  const Scalar typical = gaps[static_cast<std::size_t>(0.9999 * static_cast<Scalar>(gaps.size()))];
  std::cout << "pairs " << count << ", overlapping " << overlapping << ", inconclusive "
            << inconclusive << ", (upper - lower) / size: 99.99% " << typical << ", largest "
            << gaps.back() << ", above 1e-12 "
            << gaps.end() - std::upper_bound(gaps.begin(), gaps.end(), 1e-12)
            << ", iterations mean " << static_cast<Scalar>(all_iterations) / count << ", most "
            << most_iterations << "\n";
  EXPECT_LT(typical, 3e-14);
  EXPECT_LT(gaps.back(), 1e-11);
  EXPECT_LT(inconclusive, count / 1000 + 1);
  EXPECT_LT(most_iterations, 60);
}

TEST(Gjk, SwappingAndMovingTheFrameChangeNothingButNoise) {
  RandomPairs pairs(11, 16);
  for (int i = 0; i < 5000; ++i) {
    const auto [a, b, X_AB] = pairs.next();
    const Scalar size = pair_size(a, b, X_AB);
    const GjkResult r = gjk_distance(a, b, X_AB);
    const GjkResult swapped = gjk_distance(b, a, X_AB.inverse());
    ASSERT_LE(r.lower, swapped.upper) << "pair " << i;
    ASSERT_LE(swapped.lower, r.upper) << "pair " << i;
    const RigidPose X_WA(rotation_from_vector(2 * pairs.unit()), pairs.unit() * size);
    const RigidPose X_WB = X_WA * X_AB;
    const GjkResult moved = gjk_distance(a, b, X_WA.inverse() * X_WB);
    const Scalar noise = kPoseNoise * 2 * size;
    ASSERT_LE(r.lower, moved.upper + noise) << "pair " << i;
    ASSERT_LE(moved.lower, r.upper + noise) << "pair " << i;
  }
}

// Shapes of a few times the smallest number: bounds must not cross, whatever underflows.
TEST(Gjk, BoundsTheDistanceOfDenormalShapes) {
  constexpr Scalar kTiny = std::numeric_limits<Scalar>::denorm_min();
  const ConvexHull a({kTiny * Vector3(-1, -3, 3), kTiny * Vector3(2, 1, 0)});
  const ConvexHull b(
      {kTiny * Vector3(-1, -5, 4), kTiny * Vector3(0, -8, 4), kTiny * Vector3(3, -5, 6)});
  for (int k = 0; k <= 8; ++k) {
    const RigidPose X_AB(rotation_from_vector(Vector3(0.1 * k, 0.2, -0.3 * k)), Vector3::Zero());
    const GjkResult result = gjk_distance(a, b, X_AB);
    EXPECT_LE(result.lower, result.upper);
  }
}

// Where squares of coordinates underflow, the allowance for rounding must not be lost with them.
TEST(Gjk, BoundsTheDistanceWhereSquaresUnderflow) {
  std::mt19937_64 random(3);
  constexpr Scalar kTiny = std::numeric_limits<Scalar>::denorm_min();
  const ConvexHull points({kTiny * Vector3(-1, -3, 3), kTiny * Vector3(2, 1, 0)});
  for (const Scalar size : {1e-300, 1e-240, 1e-170, 1e-150}) {
    const ConvexHull hull(
        {size * Vector3(1, 0, 0), size * Vector3(0, 1, 0), size * Vector3(0, 0, 1)});
    for (int k = 0; k < 3000; ++k) {
      const RigidPose X_AB(
          testing::random_rotation(random),
          size * testing::random_number(1e-3, 3, random) * testing::random_direction(random));
      for (const ConvexHull* b : {&points, &hull}) {
        const GjkResult result = gjk_distance(points, *b, X_AB);
        ASSERT_LE(result.lower, result.upper) << size;
        if (b == &points) {  // as good as two points
          const Scalar exact = size * (X_AB.translation() / size).norm();
          ASSERT_LE(result.lower, exact + 10 * kTiny);
          ASSERT_GE(result.upper, exact - 10 * kTiny);
        }
      }
    }
  }
}

}  // namespace
}  // namespace dyop
