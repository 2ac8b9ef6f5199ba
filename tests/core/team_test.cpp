// SPDX-License-Identifier: BSD-3-Clause
#include "core/team.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <numeric>
#include <stdexcept>
#include <thread>
#include <vector>

#include "dyop/core/error.h"

namespace dyop::core_internal {
namespace {

// The machine may have fewer threads than a test asks for.
class TeamLoops : public ::testing::Test {
 protected:
  template <typename Lead>
  void with_team(int threads, const Lead& lead) {
    arena_.execute([&] { core_internal::with_team(threads, lead); });
  }

 private:
  tbb::global_control threads_{tbb::global_control::max_allowed_parallelism, 8};
  tbb::task_arena arena_{8};
};

// Plain integers: thread sanitizers see if two threads have the same item, or the next loop begins
// before the last is over.
TEST_F(TeamLoops, TakeEveryItemOnceInEveryLoop) {
  for (const int threads : {0, 1, 2, 3, 8}) {
    with_team(threads, [&](Team& team) {
      EXPECT_EQ(team.has_helpers(), threads != 1);
      std::vector<int> runs(1000, 0);
      std::vector<std::size_t> wanted(runs.size(), 0);
      for (std::size_t loop = 0; loop < 3000; ++loop) {
        const std::size_t count = loop % (runs.size() + 1);
        team.run(count, 1 + loop % 40, [&](std::size_t begin, std::size_t end) {
          EXPECT_LT(begin, end);
          for (std::size_t i = begin; i < end; ++i) ++runs[i];
        });
        for (std::size_t i = 0; i < count; ++i) ++wanted[i];
      }
      EXPECT_TRUE(std::equal(runs.begin(), runs.end(), wanted.begin()));
    });
  }
}

// A helper that is late for a short loop must not take a part of the long one that follows. With
// more threads than cores they are often late.
TEST_F(TeamLoops, HelpersThatAreLateTakeNothingTwice) {
  with_team(8, [](Team& team) {
    std::vector<std::atomic<int>> runs(400);
    int wanted_of_first = 0;
    int wanted_of_last = 0;
    for (int loop = 0; loop < 60000; ++loop) {
      const std::size_t count = loop % 2 == 0 ? 2 : runs.size();
      team.run(count, 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) runs[i].fetch_add(1, std::memory_order_relaxed);
      });
      ++wanted_of_first;
      wanted_of_last += loop % 2;
      for (std::size_t i = 0; i < count; ++i) {
        ASSERT_EQ(runs[i].load(std::memory_order_relaxed), i < 2 ? wanted_of_first : wanted_of_last)
            << "item " << i << " in loop " << loop;
      }
    }
  });
}

TEST_F(TeamLoops, HelpersTakePart) {
  with_team(8, [](Team& team) {
    const auto leader = std::this_thread::get_id();
    std::atomic<bool> has_help = false;
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!has_help && std::chrono::steady_clock::now() < end) {
      team.run(100, 1, [&](std::size_t, std::size_t) {
        if (std::this_thread::get_id() != leader) has_help = true;
        std::this_thread::yield();
      });
    }
    EXPECT_TRUE(has_help);
  });
}

// Here no helper ever comes: the arena has room for the leader alone.
TEST(Team, TheLeaderGetsOnAlone) {
  const tbb::global_control threads{tbb::global_control::max_allowed_parallelism, 8};
  tbb::task_arena arena{1};
  arena.execute([] {
    with_team(8, [](Team& team) {
      std::vector<int> runs(500, 0);
      for (int loop = 0; loop < 100; ++loop) {
        team.run(runs.size(), 1, [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) ++runs[i];
        });
      }
      EXPECT_EQ(std::accumulate(runs.begin(), runs.end(), 0), 50000);
    });
  });
}

TEST_F(TeamLoops, TeamsWithinTeamsAndMoreThreadsThanCores) {
  with_team(8, [&](Team& outer) {
    std::atomic<int> sum = 0;
    outer.run(16, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        core_internal::with_team(4, [&](Team& inner) {
          for (int loop = 0; loop < 20; ++loop) {
            inner.run(50, 1, [&](std::size_t from, std::size_t to) { sum += int(to - from); });
          }
        });
      }
    });
    EXPECT_EQ(sum, 16 * 20 * 50);
  });
}

TEST_F(TeamLoops, ThrowWhatTheLeaderThrows) {
  for (const int threads : {1, 8}) {
    EXPECT_THROW(with_team(threads, [](Team&) { throw std::runtime_error("over"); }),
                 std::runtime_error);
  }
  EXPECT_THROW(with_team(-1, [](Team&) {}), InvalidArgument);
}

}  // namespace
}  // namespace dyop::core_internal
