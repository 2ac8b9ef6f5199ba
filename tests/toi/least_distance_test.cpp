// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/least_distance.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/primitives.h"
#include "geometry/all_compounds.h"
#include "motion/all_motions.h"
#include "support/inputs/bodies.h"
#include "support/message_of.h"
#include "support/oracles/toi_oracle.h"

namespace dyop {
namespace {

using namespace testing;  // NOLINT: makers
using testing::at;
using testing::kAllMotions;
using testing::MotionPointer;
using testing::moving;
using testing::Scales;

Scalar noise_of(const LeastDistanceResult& result, Scalar size) {
  return result.rounding_allowance + 1e-10 * size;
}

// Two balls that pass at the height 2: sqrt((2t - 5)^2 + 4) - 1.5, least 0.5 at t = 2.5.
TEST(LeastDistance, OfBallsThatPass) {
  const Sphere a(1);
  const Sphere b(0.5);
  LeastDistanceOptions options;
  for (const Scalar tolerance : {0.1, 1e-3, 1e-6, 1e-9, 0.0}) {
    options.relative_tolerance = tolerance;
    const LeastDistanceResult found =
        least_distance(a, moving(at(-5, 2, 0), {2, 0, 0}), b, RestMotion(), {0, 4}, options);
    EXPECT_EQ(found.status, LeastDistanceStatus::Bounded) << tolerance;
    EXPECT_LE(found.lower, 0.5);
    EXPECT_GE(found.upper, 0.5);
    EXPECT_LE(found.upper - found.lower, tolerance * 0.6 + 64 * found.rounding_allowance);
    EXPECT_NEAR(found.t_upper, 2.5, 0.01 + std::sqrt(tolerance));
    EXPECT_LE(found.nearest.lower, found.upper);
  }
}

TEST(LeastDistance, AtTheEndsOfTheIntervalAndAtOneTime) {
  const Sphere ball(1);
  const ConstantTwistMotion closing = moving(at(-5, 0, 0), {1, 0, 0});
  const LeastDistanceResult end = least_distance(ball, closing, ball, RestMotion(), {0, 2});
  EXPECT_NEAR(end.upper, 1, 1e-9);
  EXPECT_EQ(end.t_upper, 2);
  const LeastDistanceResult begin =
      least_distance(ball, moving(at(-5, 0, 0), {-1, 0, 0}), ball, RestMotion(), {0, 2});
  EXPECT_NEAR(begin.upper, 3, 1e-9);
  EXPECT_EQ(begin.t_upper, 0);
  const LeastDistanceResult once = least_distance(ball, closing, ball, RestMotion(), {1, 1});
  EXPECT_EQ(once.status, LeastDistanceStatus::Bounded);
  EXPECT_LE(once.lower, 2);
  EXPECT_GE(once.lower, 1.97);
  EXPECT_NEAR(once.upper, 2, 1e-9);
}

TEST(LeastDistance, OfBodiesThatTouchIsZero) {
  const Sphere ball(1);
  const LeastDistanceResult through =
      least_distance(ball, moving(at(-5, 0.3, 0), {3, 0, 0}), ball, RestMotion(), {0, 3});
  EXPECT_EQ(through.status, LeastDistanceStatus::Bounded);
  EXPECT_EQ(through.lower, 0);
  EXPECT_LE(through.upper, 1e-9);
  // Inside a solid all the time.
  const TriangleMesh shell = icosphere(2, 5).mesh();
  LeastDistanceOptions options;
  EXPECT_GT(least_distance(shell, RestMotion(), ball, RestMotion(), {0, 1}, options).lower, 3);
  options.solid_a = true;
  EXPECT_EQ(least_distance(shell, RestMotion(), ball, RestMotion(), {0, 1}, options).lower, 0);
}

// The oracle bounds the minimum with distances at single times and a Lipschitz bound of its own.
TEST(LeastDistance, AgreesWithTheOracleOnAllMotionsAndShapes) {
  testing::Random random(17);
  int apart = 0;
  int count = 0;
  std::vector<std::shared_ptr<const Shape>> unit_shapes{
      std::make_shared<TriangleMesh>(torus(0.7, 0.3, 8, 5).mesh()),
      std::make_shared<TriangleMesh>(gear(5, 0.8, 1, 0.2).mesh())};
  for (const ShapeMaker& maker : all_shapes()) {
    std::shared_ptr<const ConvexShape> shape = maker.make(0.5);
    // The oracle knows no smooth cores.
    if (shape->core_surface()) unit_shapes.push_back(std::move(shape));
  }
  for (const testing::MotionMaker& maker : kAllMotions) {
    for (std::size_t k = 0; k < 3 * unit_shapes.size(); ++k) {
      const Shape& a = *unit_shapes[k % unit_shapes.size()];
      const Shape& b = *unit_shapes[(k * 5 + 1) % unit_shapes.size()];
      const Scales scales{1.5, 3, k % 2 == 0 ? 1.0 : 6.0, {-1, 1.5}};
      const MotionPointer X_WA = maker.make(random, scales);
      const MotionPointer X_WB = kAllMotions[k % kAllMotions.size()].make(random, scales);
      LeastDistanceOptions options;
      options.relative_tolerance = k % 3 == 0 ? 0.1 : 1e-3;
      const LeastDistanceResult found = least_distance(a, *X_WA, b, *X_WB, scales.span, options);
      SCOPED_TRACE(std::string(maker.name) + " " + std::to_string(k));
      EXPECT_EQ(found.status, LeastDistanceStatus::Bounded);
      const testing::OracleBody body_a(a);
      const testing::OracleBody body_b(b);
      testing::ToiOracle oracle(body_a, *X_WA, body_b, *X_WB);
      constexpr Scalar kResolution = 0.02;
      const testing::MinimumDistance least = oracle.min_distance_on(scales.span, kResolution);
      EXPECT_LE(found.lower, least.upper + noise_of(found, 10));
      EXPECT_GE(found.upper, least.lower - noise_of(found, 10));
      EXPECT_LE(found.upper - found.lower,
                std::max(options.relative_tolerance * found.upper, 64 * found.rounding_allowance));
      for (int s = 0; s <= 50; ++s) {
        const Scalar t = scales.span.begin + scales.span.length() * s / 50;
        EXPECT_GE(oracle.distance_at(t, 1e-3).upper, found.lower - noise_of(found, 10));
      }
      EXPECT_LE(oracle.distance_at(found.t_upper, 1e-6).lower, found.upper + noise_of(found, 10));
      ++count;
      if (found.lower > 0) ++apart;
    }
  }
  EXPECT_GT(apart, count / 3);
  EXPECT_LT(apart, count);
}

// Compounds, small, large and far away: dense samples of distance() never fall below the bound.
TEST(LeastDistance, HoldsAtAllScalesAndForCompounds) {
  testing::Random random(23);
  int apart = 0;
  for (const Scalar size : {1e-4, 1.0, 1e4}) {
    for (const Scalar far : {0.0, 1e4}) {
      for (const CompoundMaker& maker : all_compounds()) {
        for (const testing::MotionMaker& motion : kAllMotions) {
          const auto a = maker.make(0.4 * size);
          const auto b = all_compounds()[2].make(0.3 * size);
          const Scales scales{size, 1.5 * size, 2, {0, 1}};
          const auto away = std::make_shared<RestMotion>(at(far * size, 0, far * size));
          const ComposedMotion X_WA(away, motion.make(random, scales));
          const ComposedMotion X_WB(away, testing::hermite(random, scales));
          const LeastDistanceResult found = least_distance(*a, X_WA, *b, X_WB, scales.span);
          EXPECT_EQ(found.status, LeastDistanceStatus::Bounded) << motion.name;
          if (found.lower > 0) ++apart;
          for (int s = 0; s <= 60; ++s) {
            const Scalar t = s / 60.0;
            const DistanceResult d = distance(*a, X_WA.pose(t), *b, X_WB.pose(t));
            EXPECT_GE(d.upper, found.lower) << motion.name << " " << maker.name;
          }
        }
      }
    }
  }
  EXPECT_GT(apart, 60);
}

TEST(LeastDistance, StopsBeyondMaxDistance) {
  const TriangleMesh mesh = gear(12, 0.8, 1, 0.2).mesh();
  const ConstantTwistMotion X_WA = moving(at(-5, 3, 0), {2, 0, 0}, {0, 3, 0});
  LeastDistanceOptions options;
  const LeastDistanceResult whole = least_distance(mesh, X_WA, mesh, RestMotion(), {0, 4}, options);
  options.max_distance = 0.5 * whole.lower;
  const LeastDistanceResult cut = least_distance(mesh, X_WA, mesh, RestMotion(), {0, 4}, options);
  EXPECT_EQ(cut.status, LeastDistanceStatus::FartherThanMaxDistance);
  EXPECT_GT(cut.lower, options.max_distance);
  EXPECT_LE(cut.lower, whole.upper);
  EXPECT_LT(cut.statistics.node_pairs, whole.statistics.node_pairs);
  options.max_distance = 2 * whole.upper;
  EXPECT_EQ(least_distance(mesh, X_WA, mesh, RestMotion(), {0, 4}, options).status,
            LeastDistanceStatus::Bounded);
}

// Whatever the budget, the bounds hold.
TEST(LeastDistance, HoldsUnderEveryBudget) {
  const TriangleMesh mesh = torus(1, 0.3, 24, 12).mesh();
  const ConstantTwistMotion X_WA = moving(at(-3, 2.7, 0), {2, 0, 0}, {0, 3, 2});
  LeastDistanceOptions options;
  options.relative_tolerance = 1e-4;
  const LeastDistanceResult whole = least_distance(mesh, X_WA, mesh, RestMotion(), {0, 3}, options);
  ASSERT_EQ(whole.status, LeastDistanceStatus::Bounded);
  int exhausted = 0;
  for (std::int64_t budget = 1; budget < 2 * whole.statistics.node_pairs;
       budget = 1 + budget * 3 / 2) {
    options.max_node_pairs = budget;
    const LeastDistanceResult found =
        least_distance(mesh, X_WA, mesh, RestMotion(), {0, 3}, options);
    EXPECT_LE(found.statistics.node_pairs, budget);
    EXPECT_LE(found.lower, whole.upper);
    EXPECT_GE(found.upper, whole.lower);
    if (found.status == LeastDistanceStatus::BudgetExhausted) ++exhausted;
  }
  EXPECT_GT(exhausted, 2);
  options = {};
  options.deadline = std::chrono::steady_clock::now();
  const LeastDistanceResult late = least_distance(mesh, X_WA, mesh, RestMotion(), {0, 3}, options);
  EXPECT_EQ(late.status, LeastDistanceStatus::BudgetExhausted);
  EXPECT_LE(late.lower, whole.upper);
  std::stop_source stop;
  stop.request_stop();
  options = {};
  options.stop = stop.get_token();
  EXPECT_EQ(least_distance(mesh, X_WA, mesh, RestMotion(), {0, 3}, options).status,
            LeastDistanceStatus::Cancelled);
}

TEST(LeastDistance, RefusesInvalidInputByName) {
  const Sphere ball(1);
  const auto message = [&](const LeastDistanceOptions& options) {
    return testing::message_of([&] {
      least_distance(ball, RestMotion(), ball, RestMotion(), {0, 1}, options);
    });
  };
  LeastDistanceOptions options;
  options.relative_tolerance = 1;
  EXPECT_NE(message(options).find("relative_tolerance"), std::string::npos);
  options = {};
  options.absolute_tolerance = -1;
  EXPECT_NE(message(options).find("absolute_tolerance"), std::string::npos);
  options = {};
  options.max_distance = std::nan("");
  EXPECT_NE(message(options).find("max_distance"), std::string::npos);
  options = {};
  options.max_node_pairs = 0;
  EXPECT_NE(message(options).find("max_node_pairs"), std::string::npos);
  EXPECT_NE(testing::message_of([&] {
              least_distance(ball, RestMotion(), ball, RestMotion(), {1, 0});
            }).find("begin 1 > end 0"),
            std::string::npos);
}

}  // namespace
}  // namespace dyop
