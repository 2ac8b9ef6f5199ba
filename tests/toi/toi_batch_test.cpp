// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <array>
#include <stdexcept>

#include "dyop/core/error.h"
#include "dyop/geometry/primitives.h"
#include "dyop/motion/motion.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/message_of.h"
#include "support/same_bits.h"

namespace dyop {
namespace {

using testing::message_of;

// The machine may have fewer threads than a test asks for.
class ToiBatch : public ::testing::Test {
 protected:
  // Gears and tori that turn and fly past or into each other; every fifth runs out of its budget.
  std::vector<ToiQuery> random_queries(int count) {
    const std::array<const Shape*, 3> shapes{&gear_, &torus_, &sphere_};
    std::mt19937_64 random(11);
    motions_.reserve(2 * std::size_t(count));  // pointers to them are kept
    std::vector<ToiQuery> queries;
    for (int i = 0; i < count; ++i) {
      motions_.emplace_back(RigidPose(), Twist{Vector3::Zero(), testing::random_vector(3, random)});
      const Vector3 p = 3 * testing::random_direction(random);
      const Vector3 v = (testing::random_vector(1.5, random) - p).normalized() * 1.5;
      const Vector3 w = testing::random_vector(3, random);
      motions_.emplace_back(RigidPose(testing::random_rotation(random), p), Twist{v, w});
      ToiQuery query;
      query.a = shapes[std::size_t(testing::random_index(3, random))];
      query.b = shapes[std::size_t(testing::random_index(3, random))];
      query.X_WA = &motions_[motions_.size() - 2];
      query.X_WB = &motions_.back();
      query.interval = {0, 2};
      if (i % 5 == 0) query.options.max_node_pairs = 1 + i;
      queries.push_back(query);
    }
    return queries;
  }

  tbb::global_control threads_{tbb::global_control::max_allowed_parallelism, 8};
  const TriangleMesh gear_ = testing::gear(15, 0.8, 1, 0.2).mesh();
  const TriangleMesh torus_ = testing::torus(0.8, 0.3, 24, 12).mesh();
  const Sphere sphere_{0.6};
  std::vector<ConstantTwistMotion> motions_;
};
using ToiBatchDeterminism = ToiBatch;

ToiResult single(const ToiQuery& q) {
  return time_of_impact(*q.a, *q.X_WA, *q.b, *q.X_WB, q.interval, q.options);
}

void expect_same_work(const ToiResult& x, const ToiResult& y) {
  EXPECT_TRUE(testing::has_same_bits(x, y)) << x.t_safe << " " << y.t_safe;
  EXPECT_EQ(x.statistics.node_pairs, y.statistics.node_pairs);
  EXPECT_EQ(x.statistics.box_tests, y.statistics.box_tests);
  EXPECT_EQ(x.statistics.leaf_tests, y.statistics.leaf_tests);
  EXPECT_EQ(x.statistics.peak_queue, y.statistics.peak_queue);
}

TEST_F(ToiBatchDeterminism, GivesTheBitsOfSingleQueriesForEveryNumberOfThreads) {
  const std::vector<ToiQuery> queries = random_queries(150);
  std::vector<ToiResult> expected;
  std::array<int, 7> statuses{};
  for (const ToiQuery& query : queries) {
    expected.push_back(single(query));
    ++statuses[std::size_t(expected.back().status)];
  }
  EXPECT_GT(statuses[std::size_t(ToiStatus::Separated)], 10);
  EXPECT_GT(statuses[std::size_t(ToiStatus::Impact)], 10);
  EXPECT_GT(statuses[std::size_t(ToiStatus::BudgetExhausted)], 5);
  for (const int threads : {0, 1, 2, 3, 8}) {
    BatchOptions options;
    options.thread_count = threads;
    std::vector<ToiResult> results(queries.size());
    time_of_impact_batch(queries, results, options);
    for (std::size_t i = 0; i < queries.size(); ++i) expect_same_work(results[i], expected[i]);
  }
}

TEST_F(ToiBatch, TellsAfterAStopWhatIsKnownOfEachQuery) {
  std::vector<ToiQuery> queries = random_queries(200);
  for (ToiQuery& query : queries) query.interval.begin = 0.25;
  for (const int threads : {1, 2, 8}) {
    std::stop_source source;
    BatchOptions options;
    options.thread_count = threads;
    options.stop = source.get_token();
    std::size_t last_done = 0;
    options.progress = [&](std::size_t done, std::size_t total) {
      EXPECT_EQ(done, last_done + 1);
      EXPECT_EQ(total, queries.size());
      last_done = done;
      if (done == 30) source.request_stop();
    };
    std::vector<ToiResult> results(queries.size());
    time_of_impact_batch(queries, results, options);
    EXPECT_GE(last_done, 30u);
    EXPECT_LE(last_done, 30u + std::size_t(threads));
    std::size_t run = 0;
    for (std::size_t i = 0; i < queries.size(); ++i) {
      if (results[i].status == ToiStatus::NotRun) {
        EXPECT_EQ(results[i].t_safe, 0.25);
        EXPECT_FALSE(results[i].contact.has_value());
        continue;
      }
      ++run;
      if (results[i].status == ToiStatus::Cancelled) {
        EXPECT_GE(results[i].t_safe, 0.25);
        EXPECT_LE(results[i].t_safe, single(queries[i]).t_safe);
      } else {
        expect_same_work(results[i], single(queries[i]));
      }
    }
    EXPECT_EQ(run, last_done);
  }
}

UserMotion::Functions resting() {
  UserMotion::Functions functions;
  functions.pose = [](Scalar) { return RigidPose(); };
  functions.twist = [](Scalar) { return Twist(); };
  functions.twist_bound = [](const TimeInterval&) { return TwistBound(); };
  return functions;
}

TEST_F(ToiBatch, StopsTheQueriesThatAreUnderWay) {
  // The first evaluation of B's path requests the stop: the query must see it, whether or not it
  // has a stop of its own. B is where A starts, so that balls about the origins decide nothing.
  ToiQuery query = random_queries(1)[0];
  const Motion& X_WA = *query.X_WA;
  for (const bool has_own_stop : {false, true}) {
    std::stop_source source;
    UserMotion::Functions functions = resting();
    functions.pose = [&](Scalar) {
      source.request_stop();
      return X_WA.pose(0);
    };
    const UserMotion path(functions);
    query.X_WB = &path;
    query.interval = {0, 1};
    std::stop_source own;
    if (has_own_stop) query.options.stop = own.get_token();
    BatchOptions options;
    options.stop = source.get_token();
    ToiResult result;
    time_of_impact_batch({&query, 1}, {&result, 1}, options);
    EXPECT_EQ(result.status, ToiStatus::Cancelled);
    EXPECT_EQ(result.t_safe, 0);
  }
}

TEST_F(ToiBatch, LetsAQueryHaveAStopOfItsOwn) {
  std::vector<ToiQuery> queries = random_queries(8);
  std::stop_source own;
  queries[3].options.stop = own.get_token();
  own.request_stop();
  std::stop_source of_all;
  for (const bool has_stop_of_all : {false, true}) {
    BatchOptions options;
    if (has_stop_of_all) options.stop = of_all.get_token();
    std::vector<ToiResult> results(queries.size());
    time_of_impact_batch(queries, results, options);
    for (std::size_t i = 0; i < queries.size(); ++i) {
      if (i != 3) expect_same_work(results[i], single(queries[i]));
    }
    EXPECT_EQ(results[3].status, ToiStatus::Cancelled);
  }
}

TEST_F(ToiBatch, RefusesBadQueriesNamingTheFirstBeforeAnyRuns) {
  std::vector<ToiQuery> queries = random_queries(9);
  std::vector<ToiResult> results(queries.size());
  const auto message = [&] {
    return message_of<std::exception>([&] { time_of_impact_batch(queries, results); });
  };
  queries[7].X_WB = nullptr;
  EXPECT_EQ(message(), "query 7: a motion is missing");
  queries[6].a = nullptr;
  EXPECT_EQ(message(), "query 6: a shape is missing");
  const SampledMotion short_path({{0, RigidPose()}, {1, RigidPose()}});
  queries[5].X_WA = &short_path;
  EXPECT_NE(message().find("query 5: time_of_impact: the motion of A is defined only on [0, 1]"),
            std::string::npos);
  queries[4].options.distance_tolerance = -1;
  EXPECT_NE(message().find("query 4: time_of_impact: distance_tolerance"), std::string::npos);
  EXPECT_EQ(results[0].status, ToiStatus::NotRun);
  results.pop_back();
  EXPECT_EQ(message(), "time_of_impact: 9 queries, but space for 8 results");
}

TEST_F(ToiBatch, PassesOnWhatAMotionThrows) {
  std::vector<ToiQuery> queries = random_queries(40);
  UserMotion::Functions functions = resting();
  functions.pose = [](Scalar) -> RigidPose { throw std::range_error("lost track"); };
  const UserMotion broken(functions);
  queries[20].X_WA = &broken;
  for (const int threads : {1, 2, 8}) {
    BatchOptions options;
    options.thread_count = threads;
    std::vector<ToiResult> results(queries.size());
    EXPECT_THROW(time_of_impact_batch(queries, results, options), std::range_error);
    EXPECT_EQ(results[20].status, ToiStatus::NotRun);
    for (std::size_t i = 0; i < 20; ++i) expect_same_work(results[i], single(queries[i]));
  }
}

TEST_F(ToiBatch, MayBeEmpty) {
  time_of_impact_batch(std::span<const ToiQuery>(), {});
}

}  // namespace
}  // namespace dyop
