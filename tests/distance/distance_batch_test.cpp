// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <array>

#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/message_of.h"
#include "support/same_bits.h"

namespace dyop {
namespace {

using testing::has_same_bits;
using testing::message_of;

// The machine may have fewer threads than a test asks for.
class DistanceBatch : public ::testing::Test {
 protected:
  // Meshes and convex shapes, near and far, some with a limit or a penetration.
  std::vector<DistanceQuery> random_queries(int count) {
    const std::array<const Shape*, 4> shapes{&gear_, &torus_, &box_, &sphere_};
    std::mt19937_64 random(7);
    std::vector<DistanceQuery> queries;
    for (int i = 0; i < count; ++i) {
      DistanceQuery query;
      query.a = shapes[std::size_t(testing::random_index(4, random))];
      query.b = shapes[std::size_t(testing::random_index(4, random))];
      query.X_WA = testing::random_pose(1, random);
      query.X_WB = testing::random_pose(2, random);
      if (i % 3 == 0) query.options.max_distance = testing::random_number(0, 1, random);
      query.options.with_penetration = i % 2 == 0;
      queries.push_back(query);
    }
    return queries;
  }

  tbb::global_control threads_{tbb::global_control::max_allowed_parallelism, 8};
  const TriangleMesh gear_ = testing::gear(15, 0.8, 1, 0.2).mesh();
  const TriangleMesh torus_ = testing::torus(0.8, 0.3, 24, 12).mesh();
  const Box box_{Vector3(0.5, 0.7, 0.3)};
  const Sphere sphere_{0.6};
};
using DistanceBatchDeterminism = DistanceBatch;

void expect_same(const DistanceResult& x, const DistanceResult& y) {
  EXPECT_EQ(x.status, y.status);
  EXPECT_TRUE(has_same_bits(x.lower, y.lower) && has_same_bits(x.upper, y.upper));
  EXPECT_TRUE(has_same_bits(x.p_WCa, y.p_WCa) && has_same_bits(x.p_WCb, y.p_WCb));
  EXPECT_TRUE(has_same_bits(x.nhat_AB_W, y.nhat_AB_W) && has_same_bits(x.pivot_W(), y.pivot_W()));
  EXPECT_EQ(x.triangle_a, y.triangle_a);
  EXPECT_EQ(x.triangle_b, y.triangle_b);
  EXPECT_EQ(x.statistics.box_tests, y.statistics.box_tests);
  EXPECT_EQ(x.statistics.leaf_tests, y.statistics.leaf_tests);
  ASSERT_EQ(x.penetration.has_value(), y.penetration.has_value());
  if (x.penetration) {
    EXPECT_TRUE(has_same_bits(x.penetration->depth, y.penetration->depth));
  }
}

TEST_F(DistanceBatchDeterminism, GivesTheBitsOfSingleQueriesForEveryNumberOfThreads) {
  const std::vector<DistanceQuery> queries = random_queries(200);
  std::vector<DistanceResult> single;
  for (const DistanceQuery& q : queries) {
    single.push_back(distance(*q.a, q.X_WA, *q.b, q.X_WB, q.options));
  }
  for (const int threads : {0, 1, 2, 3, 8}) {
    BatchOptions options;
    options.thread_count = threads;
    std::vector<DistanceResult> results(queries.size());
    distance_batch(queries, results, options);
    for (std::size_t i = 0; i < queries.size(); ++i) expect_same(results[i], single[i]);
  }
}

TEST_F(DistanceBatchDeterminism, StartsFromTheCachesOfTheQueries) {
  std::vector<DistanceQuery> queries = random_queries(60);
  std::vector<DistanceCache> batch_caches(queries.size());
  std::vector<DistanceCache> single_caches(queries.size());
  for (std::size_t i = 0; i < queries.size(); ++i) queries[i].cache = &batch_caches[i];
  std::vector<DistanceResult> results(queries.size());
  for (int repeat = 0; repeat < 2; ++repeat) {
    distance_batch(queries, results);
    for (std::size_t i = 0; i < queries.size(); ++i) {
      const DistanceQuery& q = queries[i];
      expect_same(results[i], distance(*q.a, q.X_WA, *q.b, q.X_WB, q.options, single_caches[i]));
    }
  }
}

TEST_F(DistanceBatch, LeavesQueriesThatAStopForestalledNotRun) {
  const std::vector<DistanceQuery> queries = random_queries(300);
  for (const int threads : {1, 8}) {
    std::stop_source source;
    BatchOptions options;
    options.thread_count = threads;
    options.stop = source.get_token();
    std::size_t answered = 0;
    options.progress = [&](std::size_t done, std::size_t) {
      answered = done;
      if (done == 20) source.request_stop();
    };
    std::vector<DistanceResult> results(queries.size());
    distance_batch(queries, results, options);
    EXPECT_GE(answered, 20u);
    EXPECT_LE(answered, 20u + 8u);
    std::size_t run = 0;
    for (std::size_t i = 0; i < queries.size(); ++i) {
      const DistanceQuery& q = queries[i];
      if (results[i].status == DistanceStatus::NotRun) continue;
      ++run;
      expect_same(results[i], distance(*q.a, q.X_WA, *q.b, q.X_WB, q.options));
    }
    EXPECT_EQ(run, answered);
  }
}

TEST_F(DistanceBatch, ForgetsWhatTheResultsHeldBefore) {
  const std::vector<DistanceQuery> queries = random_queries(2);
  std::stop_source source;
  source.request_stop();
  BatchOptions options;
  options.stop = source.get_token();
  std::vector<DistanceResult> results(2);
  distance_batch(queries, results);
  EXPECT_NE(results[1].status, DistanceStatus::NotRun);
  distance_batch(queries, results, options);
  EXPECT_EQ(results[1].status, DistanceStatus::NotRun);
  EXPECT_EQ(results[1].lower, 0);
  EXPECT_EQ(results[1].upper, kInfinity);
}

TEST_F(DistanceBatch, RefusesBadQueriesNamingTheFirst) {
  std::vector<DistanceQuery> queries = random_queries(9);
  std::vector<DistanceResult> results(queries.size());
  queries[7].b = nullptr;
  queries[5].options.max_distance = -0.5;
  EXPECT_EQ(message_of([&] { distance_batch(queries, results); }),
            "query 5: max_distance must be >= 0, not -0.5");
  queries[5].options.max_distance = 1;
  EXPECT_EQ(message_of([&] { distance_batch(queries, results); }), "query 7: a shape is missing");
  EXPECT_EQ(results[0].status, DistanceStatus::NotRun);
  results.pop_back();
  EXPECT_EQ(message_of([&] { distance_batch(queries, results); }),
            "distance: 9 queries, but space for 8 results");
}

TEST_F(DistanceBatch, MayBeEmpty) {
  distance_batch(std::span<const DistanceQuery>(), {});
}

}  // namespace
}  // namespace dyop
