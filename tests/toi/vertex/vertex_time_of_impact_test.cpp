// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/vertex_time_of_impact.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "support/inputs/path_inputs.h"
#include "support/message_of.h"
#include "support/oracles/path_oracle.h"

namespace dyop {
namespace {

using testing::FourPaths;
using testing::PathKind;

VertexPath resting(double x, double y, double z) {
  return {{x, y, z}, {x, y, z}};
}

const std::array<VertexPath, 3> kFloor{resting(-1, -1, 0), resting(2, -1, 0), resting(-1, 2, 0)};

// A vertex that falls from height `from` to height `to` onto the floor.
VertexFacePaths falling(double from, double to) {
  return {{{0, 0, from}, {0, 0, to}}, kFloor};
}

TEST(VertexTimeOfImpact, FindsTheTimeAVertexTakesToFallOntoAFace) {
  // Height 1 - 2 s, s = (t - 3) / 4: the gap is 1e-9 at s = 1/2, t = 5.
  VertexToiOptions options{.distance_tolerance = 1e-6};
  options.distance_tolerance = 1e-9;
  const VertexToiResult result = time_of_impact(falling(1, -1), {3, 7}, options);
  ASSERT_EQ(result.status, ToiStatus::Impact);
  EXPECT_NEAR(result.t_safe, 5, 1e-8);
  EXPECT_LT(result.t_safe, 5);
  ASSERT_TRUE(result.contact.has_value());
  EXPECT_NEAR(result.contact->closing_speed, 0.5, 1e-12);
  EXPECT_NEAR((result.contact->nhat_AB_W - Vector3(0, 0, -1)).norm(), 0, 1e-12);
  EXPECT_EQ(result.contact->feature_a.kind, FeatureKind::Vertex);
  EXPECT_EQ(result.contact->feature_b.kind, FeatureKind::Face);
  EXPECT_NEAR(result.contact->p_WCb.norm(), 0, 1e-12);
  EXPECT_LE(result.contact->upper, 1e-9 + result.rounding_allowance);
  EXPECT_GT(result.contact->lower, 0);
}

TEST(VertexTimeOfImpact, KeepsTheTargetDistance) {
  // The height 1 - 2 s reaches 1/4 at s = 3/8.
  VertexToiOptions options{.distance_tolerance = 1e-6};
  options.target_distance = 0.25;
  const VertexToiResult result = time_of_impact(falling(1, -1), {0, 1}, options);
  ASSERT_EQ(result.status, ToiStatus::Impact);
  EXPECT_NEAR(result.t_safe, 0.375, 1e-6);
  EXPECT_LT(result.t_safe, 0.375);
}

TEST(VertexTimeOfImpact, FindsTheTimeTwoEdgesCross) {
  // A rests on the axis of x; B, across it, falls with the height 1 - 4 s.
  const EdgeEdgePaths paths{
      {resting(-1, 0, 0), resting(1, 0, 0)},
      {VertexPath{{0.5, -1, 1}, {0.5, -1, -3}}, VertexPath{{0.5, 1, 1}, {0.5, 1, -3}}}};
  const VertexToiResult result = time_of_impact(paths);
  ASSERT_EQ(result.status, ToiStatus::Impact);
  EXPECT_NEAR(result.t_safe, 0.25, 1e-6);
  EXPECT_EQ(result.contact->feature_a, (Feature{FeatureKind::Edge, {0, 1}}));
  EXPECT_EQ(result.contact->feature_b, (Feature{FeatureKind::Edge, {0, 1}}));
  EXPECT_NEAR((result.contact->nhat_AB_W - Vector3(0, 0, 1)).norm(), 0, 1e-12);
  EXPECT_NEAR((result.contact->p_WCa - Vector3(0.5, 0, 0)).norm(), 0, 1e-12);
}

TEST(VertexTimeOfImpact, NamesTheVertexOfAFaceThatIsHit) {
  const VertexFacePaths paths{{{3, -1, 0}, {1, -1, 0}}, kFloor};
  const VertexToiResult result = time_of_impact(paths, {}, {.distance_tolerance = 1e-6});
  ASSERT_EQ(result.status, ToiStatus::Impact);
  EXPECT_NEAR(result.t_safe, 0.5, 1e-6);
  EXPECT_EQ(result.contact->feature_b, (Feature{FeatureKind::Vertex, {1}}));
}

TEST(VertexTimeOfImpact, ProvesThatAVertexPassesBeside) {
  const VertexFacePaths paths{{{0.6, 0.6, 1}, {0.6, 0.6, -1}}, kFloor};
  const VertexToiResult result = time_of_impact(paths, {2, 6});
  EXPECT_EQ(result.status, ToiStatus::Separated);
  EXPECT_EQ(result.t_safe, 6);
  EXPECT_FALSE(result.contact.has_value());
}

TEST(VertexTimeOfImpact, SaysWhatBeginsWithinTheTarget) {
  const VertexToiResult touching = time_of_impact(falling(0, 1), {2, 3});
  EXPECT_EQ(touching.status, ToiStatus::InitiallyWithinTarget);
  EXPECT_EQ(touching.t_safe, 2);
  ASSERT_TRUE(touching.contact.has_value());
  EXPECT_EQ(touching.contact->lower, 0);
  VertexToiOptions options{.distance_tolerance = 1e-6};
  options.target_distance = 2;
  EXPECT_EQ(time_of_impact(falling(1, 5), {}, options).status, ToiStatus::InitiallyWithinTarget);
}

TEST(VertexTimeOfImpact, LetsAVertexLeaveAContact) {
  // Half the tolerance above the floor and rising: no impact.
  const VertexToiOptions options{.distance_tolerance = 1e-6};
  EXPECT_EQ(time_of_impact(falling(5e-7, 1), {}, options).status, ToiStatus::Separated);
  EXPECT_EQ(time_of_impact(falling(5e-7, -1), {}, options).status, ToiStatus::Impact);
}

TEST(VertexTimeOfImpact, TellsAnOpenQuestionFromAMiss) {
  VertexToiOptions options{.distance_tolerance = 1e-6};
  options.max_steps = 1;
  // A vertex that passes over the border of a face that turns: more than one direction is needed.
  const VertexFacePaths paths{
      {{3, 0, 1}, {-3, 0, -1}},
      {VertexPath{{-1, -1, 0}, {-1, -1, 2}}, VertexPath{{1, -1, 0}, {1, -1, -2}},
       VertexPath{{0, 1, 0}, {0, 1, 0}}}};
  const VertexToiResult result = time_of_impact(paths, {}, options);
  EXPECT_EQ(result.status, ToiStatus::BudgetExhausted);
  EXPECT_EQ(result.steps, 1);
  options.max_steps = 1000;
  EXPECT_NE(time_of_impact(paths, {}, options).status, ToiStatus::BudgetExhausted);
}

TEST(VertexTimeOfImpact, SaysThatRoundingForbidsATolerance) {
  VertexToiOptions options{.distance_tolerance = 1e-6};
  options.distance_tolerance = 1e-30;
  const VertexToiResult result = time_of_impact(falling(1, -1), {}, options);
  EXPECT_TRUE(result.status == ToiStatus::NumericalLimit || result.status == ToiStatus::Impact);
  EXPECT_LE(result.t_safe, 0.5);
  EXPECT_GT(result.t_safe, 0.49);
  EXPECT_GE(result.rounding_allowance, kPathNoise);
}

TEST(VertexTimeOfImpact, DecidesExactlyOnRequest) {
  // The lowest point is half an ulp of one above the floor, or on it.
  VertexToiOptions options{.distance_tolerance = 1e-6};
  options.contact_rule = ContactRule::Exact;
  for (const double height : {0x1p-53, 1e-300, 5e-324}) {
    EXPECT_EQ(time_of_impact(falling(1, height), {}, options).status, ToiStatus::Separated);
    EXPECT_EQ(time_of_impact(falling(height, 1), {}, options).status, ToiStatus::Separated);
  }
  EXPECT_EQ(time_of_impact(falling(1, 0), {}, options).status, ToiStatus::Impact);
  EXPECT_EQ(time_of_impact(falling(0, 1), {}, options).status, ToiStatus::InitiallyWithinTarget);
}

TEST(VertexTimeOfImpact, TreatsAnIntervalOfNoLengthAsRest) {
  EXPECT_EQ(time_of_impact(falling(1, -1), {4, 4}).status, ToiStatus::Separated);
  const VertexToiResult result = time_of_impact(falling(0, 1), {4, 4});
  EXPECT_EQ(result.status, ToiStatus::InitiallyWithinTarget);
  EXPECT_EQ(result.t_safe, 4);
  VertexToiOptions options{.distance_tolerance = 1e-6};
  options.contact_rule = ContactRule::Exact;
  EXPECT_EQ(time_of_impact(falling(1, -1), {4, 4}, options).status, ToiStatus::Separated);
  // Edges that would cross on the way, and edges that cross at the start.
  const auto edges = [](Scalar height) {
    return EdgeEdgePaths{
        {resting(-1, 0, 0), resting(1, 0, 0)},
        {VertexPath{{0, -1, height}, {0, -1, -1}}, VertexPath{{0, 1, height}, {0, 1, -1}}}};
  };
  EXPECT_EQ(time_of_impact(edges(1), {4, 4}).status, ToiStatus::Separated);
  EXPECT_EQ(time_of_impact(edges(0), {4, 4}).status, ToiStatus::InitiallyWithinTarget);
}

TEST(VertexTimeOfImpact, RefusesInvalidInputByName) {
  const auto refusal = [](const VertexFacePaths& paths, const TimeInterval& interval,
                          const VertexToiOptions& options) {
    return testing::message_of([&] { time_of_impact(paths, interval, options); });
  };
  const auto expect_named = [](const std::string& message, const char* name) {
    EXPECT_NE(message.find(name), std::string::npos) << message;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect_named(refusal(falling(nan, 0), {}, {}), "a vertex must have finite coordinates");
  expect_named(refusal(falling(nan, 0), {}, {}), "(0, 0, nan)");
  expect_named(refusal(falling(1, 2e60), {}, {}), "(0, 0, 2e+60)");
  expect_named(refusal(falling(1, 0), {1, 0}, {}), "begin 1 > end 0");
  VertexToiOptions options{.distance_tolerance = 1e-6};
  options.distance_tolerance = 0;
  expect_named(refusal(falling(1, 0), {}, options), "distance_tolerance must be finite and > 0");
  options = {};
  options.target_distance = -1;
  expect_named(refusal(falling(1, 0), {}, options), "target_distance must be finite and >= 0");
  options = {};
  options.max_steps = 0;
  expect_named(refusal(falling(1, 0), {}, options), "max_steps must be >= 1, not 0");
  options = {};
  options.target_distance = 1;
  options.contact_rule = ContactRule::Exact;
  expect_named(refusal(falling(1, 0), {}, options), "needs a target_distance of 0, not 1");
}

struct VertexTally {
  int separated = 0;
  int impacts = 0;
  int undecided = 0;
};

// The promises of the header, against distances in 113 bits at many times.
template <typename Paths>
void check_promises(const Paths& paths, const VertexToiOptions& options, VertexTally& tally) {
  const TimeInterval interval{-2, 5};
  const VertexToiResult result = time_of_impact(paths, interval, options);
  const double allowance = result.rounding_allowance;
  const double floor = options.target_distance + options.distance_tolerance.value() / 4 - allowance;
  ASSERT_LE(interval.begin, result.t_safe);
  ASSERT_LE(result.t_safe, interval.end);
  const auto distance_at = [&](double t) {
    const auto begin = static_cast<testing::Quad>(interval.begin);
    const auto length = static_cast<testing::Quad>(interval.length());
    return static_cast<double>(
        testing::path_distance(paths, (static_cast<testing::Quad>(t) - begin) / length));
  };
  constexpr int kSamples = 60;
  if (result.status != ToiStatus::InitiallyWithinTarget) {
    for (int i = 0; i <= kSamples; ++i) {
      const double t = interval.begin + (result.t_safe - interval.begin) * i / kSamples;
      ASSERT_GE(distance_at(t), floor) << "at " << t << " before " << result.t_safe;
    }
  }
  switch (result.status) {
    case ToiStatus::Separated:
      ++tally.separated;
      EXPECT_EQ(result.t_safe, interval.end);
      EXPECT_GE(static_cast<double>(testing::least_path_distance(paths, 100)), floor);
      break;
    case ToiStatus::Impact:
      ++tally.impacts;
      EXPECT_LE(distance_at(result.t_safe),
                options.target_distance + options.distance_tolerance.value() + allowance);
      EXPECT_LE(result.contact->lower, distance_at(result.t_safe) + allowance);
      EXPECT_GE(result.contact->upper, distance_at(result.t_safe) - allowance);
      break;
    case ToiStatus::InitiallyWithinTarget:
      ++tally.impacts;
      EXPECT_LE(distance_at(interval.begin),
                options.target_distance + options.distance_tolerance.value() + allowance);
      break;
    default:
      ++tally.undecided;
  }
}

TEST(VertexTimeOfImpact, KeepsItsPromisesOnRandomPathsOfAllKindsAndSizes) {
  std::mt19937_64 random(4);
  for (const PathKind kind : testing::kAllPathKinds) {
    VertexTally tally;
    for (int i = 0; i < 90; ++i) {
      const double scale = std::array{1e-4, 1.0, 1e4}[static_cast<std::size_t>(i) % 3];
      const Vector3 offset = (i % 2 == 0 ? 0 : scale) * Vector3(1e3, -2e3, 5e2);
      const FourPaths paths = testing::placed(testing::make_paths(kind, random), scale, offset);
      VertexToiOptions options{.distance_tolerance = 1e-6};
      options.distance_tolerance = scale * (i % 4 == 0 ? 1e-3 : 1e-8);
      options.target_distance = i % 5 == 0 ? 0.1 * scale : 0;
      SCOPED_TRACE("kind " + std::to_string(static_cast<int>(kind)) + " number " +
                   std::to_string(i));
      check_promises(testing::vertex_face(paths), options, tally);
      check_promises(testing::edge_edge(paths), options, tally);
    }
    EXPECT_GT(tally.separated, 4) << static_cast<int>(kind);
    EXPECT_GT(tally.impacts, 0) << static_cast<int>(kind);
    EXPECT_EQ(tally.undecided, 0) << static_cast<int>(kind);
  }
}

TEST(VertexTimeOfImpact, AgreesWithTheOracleOnExactContact) {
  std::mt19937_64 random(5);
  VertexToiOptions options{.distance_tolerance = 1e-6};
  options.contact_rule = ContactRule::Exact;
  for (const PathKind kind : testing::kAllPathKinds) {
    for (int i = 0; i < 30; ++i) {
      const FourPaths paths = testing::make_paths(kind, random);
      const auto check = [&](const auto& pair) {
        const double least = static_cast<double>(testing::least_path_distance(pair, 200));
        ASSERT_TRUE(least < 1e-27 || least > 1e-26) << least;
        EXPECT_EQ(time_of_impact(pair, {}, options).status != ToiStatus::Separated, least < 1e-27)
            << "kind " << static_cast<int>(kind) << " number " << i << ", least distance " << least;
      };
      check(testing::vertex_face(paths));
      check(testing::edge_edge(paths));
    }
  }
}

TEST(VertexTimeOfImpact, DoesNotDependOnWhichEdgeIsA) {
  std::mt19937_64 random(6);
  for (int i = 0; i < 300; ++i) {
    const FourPaths p = testing::make_paths(PathKind::General, random);
    const VertexToiResult ab = time_of_impact(EdgeEdgePaths{{p[0], p[1]}, {p[2], p[3]}});
    const VertexToiResult ba = time_of_impact(EdgeEdgePaths{{p[2], p[3]}, {p[0], p[1]}});
    EXPECT_EQ(ab.status, ba.status);
    EXPECT_NEAR(ab.t_safe, ba.t_safe, 1e-5);
  }
}

}  // namespace
}  // namespace dyop
