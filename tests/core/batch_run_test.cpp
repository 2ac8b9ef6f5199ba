// SPDX-License-Identifier: BSD-3-Clause
#include "core/batch_run.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <chrono>
#include <numeric>
#include <string>
#include <thread>
#include <vector>

#include "dyop/core/batch_options.h"
#include "dyop/core/error.h"
#include "support/message_of.h"

namespace dyop::core_internal {
namespace {

using testing::message_of;

// The machine may have fewer threads than a test asks for.
class BatchRun : public ::testing::Test {
 protected:
  template <typename Item>
  void run_batch(std::size_t count, const BatchOptions& options, const Item& item) {
    arena_.execute([&] { core_internal::run_batch(count, options, item); });
  }

 private:
  tbb::global_control threads_{tbb::global_control::max_allowed_parallelism, 8};
  tbb::task_arena arena_{8};
};
using BatchRunDeterminism = BatchRun;

BatchOptions with_threads(int count) {
  BatchOptions options;
  options.thread_count = count;
  return options;
}

TEST_F(BatchRun, RunsEveryItemOnce) {
  for (const int threads : {0, 1, 2, 3, 8}) {
    for (const std::size_t count : {0u, 1u, 2u, 1000u}) {
      std::vector<std::atomic<int>> runs(count);
      run_batch(count, with_threads(threads), [&](std::size_t i, std::size_t) { ++runs[i]; });
      for (const auto& run : runs) EXPECT_EQ(run, 1);
    }
  }
}

TEST_F(BatchRun, NeverGivesAWorkerTwoItemsAtOnce) {
  const BatchOptions options = with_threads(8);
  std::vector<std::atomic<int>> under_way(batch_worker_count(5000, options));
  EXPECT_EQ(under_way.size(), 8u);
  std::atomic<int> clashes{0};
  run_batch(5000, options, [&](std::size_t, std::size_t worker) {
    if (++under_way.at(worker) != 1) ++clashes;
    --under_way[worker];
  });
  EXPECT_EQ(clashes, 0);
}

TEST_F(BatchRun, UsesNoMoreWorkersThanItemsAndThreads) {
  EXPECT_EQ(batch_worker_count(0, with_threads(4)), 1u);
  EXPECT_EQ(batch_worker_count(3, with_threads(4)), 3u);
  EXPECT_EQ(batch_worker_count(9, with_threads(4)), 4u);
  EXPECT_EQ(batch_worker_count(9, with_threads(1'000'000)), 8u);
  EXPECT_EQ(batch_worker_count(9, with_threads(0)), 8u);
}

TEST_F(BatchRun, ReportsProgressOneCallAtATimeInSteps) {
  for (const int threads : {1, 8}) {
    BatchOptions options = with_threads(threads);
    std::atomic<int> callers{0};
    std::vector<std::size_t> counts;  // not guarded: calls must not overlap
    options.progress = [&](std::size_t done, std::size_t total) {
      EXPECT_EQ(++callers, 1);
      EXPECT_EQ(total, 500u);
      counts.push_back(done);
      --callers;
    };
    run_batch(500, options, [](std::size_t, std::size_t) {});
    std::vector<std::size_t> expected(500);
    std::iota(expected.begin(), expected.end(), std::size_t{1});
    EXPECT_EQ(counts, expected);
  }
}

TEST_F(BatchRun, HandsOutNothingAfterAStop) {
  for (const int threads : {1, 2, 8}) {
    BatchOptions options = with_threads(threads);
    std::stop_source source;
    options.stop = source.get_token();
    options.progress = [&](std::size_t done, std::size_t) {
      if (done == 50) source.request_stop();
    };
    std::atomic<int> ran{0};
    const auto item = [&](std::size_t, std::size_t) { ++ran; };
    run_batch(1000, options, item);
    // What was running at the stop is completed.
    EXPECT_GE(ran, 50);
    EXPECT_LE(ran, 50 + threads);
    const int before = ran;
    run_batch(10, options, item);
    EXPECT_EQ(ran, before);
  }
}

TEST_F(BatchRunDeterminism, RethrowsTheLowestFailureForEveryNumberOfThreads) {
  for (const int threads : {1, 2, 3, 8}) {
    for (int repeat = 0; repeat < 50; ++repeat) {
      const auto fail_from_70 = [](std::size_t i, std::size_t) {
        if (i >= 70) throw InvalidArgument("bad " + std::to_string(i));
      };
      EXPECT_EQ(
          message_of<std::exception>([&] { run_batch(500, with_threads(threads), fail_from_70); }),
          "query 70: bad 70");
    }
  }
}

TEST_F(BatchRun, LeavesOtherExceptionsAsTheyAre) {
  EXPECT_THROW(run_batch(5, with_threads(2),
                         [](std::size_t, std::size_t) { throw std::out_of_range("map"); }),
               std::out_of_range);
  BatchOptions options = with_threads(2);
  options.progress = [](std::size_t done, std::size_t) {
    if (done == 3) throw InvalidArgument("callback");
  };
  EXPECT_EQ(
      message_of<std::exception>([&] { run_batch(9, options, [](std::size_t, std::size_t) {}); }),
      "callback");
}

TEST_F(BatchRun, RefusesANegativeNumberOfThreads) {
  const auto run = [&] { run_batch(5, with_threads(-2), [](std::size_t, std::size_t) {}); };
  EXPECT_NE(message_of(run).find("thread_count must be >= 0, not -2"), std::string::npos);
}

// Whether two items of a batch were under way together within a time that no machine needs.
bool runs_two_items_at_once() {
  std::atomic<int> under_way{0};
  std::atomic<bool> met{false};
  run_batch(2, with_threads(2), [&](std::size_t, std::size_t) {
    ++under_way;
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (!met && std::chrono::steady_clock::now() < end) {
      if (under_way == 2) met = true;
      std::this_thread::yield();
    }
    --under_way;
  });
  return met;
}

// An arena of its own for each batch gave the first batch alone a second thread.
TEST(BatchRunThreads, EveryBatchHasThem) {
  if (batch_worker_count(2, with_threads(2)) < 2) {
    GTEST_SKIP() << "runs on machines with two processors or more";
  }
  for (int batch = 0; batch < 20; ++batch) {
    ASSERT_TRUE(runs_two_items_at_once()) << "batch " << batch;
  }
}

}  // namespace
}  // namespace dyop::core_internal
