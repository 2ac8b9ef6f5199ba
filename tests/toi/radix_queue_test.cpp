// SPDX-License-Identifier: BSD-3-Clause
#include "toi/radix_queue.h"

#include <gtest/gtest.h>

#include <queue>
#include <random>

namespace dyop::toi_internal {
namespace {

// Pushes never earlier than the last time taken out, as the search does.
void compare_with_a_heap(Scalar begin, Scalar unit) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<Scalar> uniform(0, 1);
  RadixQueue queue;
  std::priority_queue<Scalar, std::vector<Scalar>, std::greater<>> heap;
  Scalar now = begin;
  const auto push = [&](Scalar time) {
    queue.push({time, 1, 2});
    heap.push(time);
  };
  push(begin);
  for (int k = 0; k < 20000; ++k) {
    const int count = k < 5000 ? 3 : int(uniform(random) * 2);
    for (int i = 0; i < count; ++i) {
      // Some the same time, some later by very different amounts.
      push(uniform(random) < 0.1 ? now : now + unit * std::pow(10.0, -12 * uniform(random)));
    }
    ASSERT_EQ(queue.size(), std::int64_t(heap.size()));
    if (heap.empty()) break;
    now = heap.top();
    heap.pop();
    ASSERT_EQ(queue.pop().time, now);
  }
  while (!heap.empty()) {
    ASSERT_EQ(queue.pop().time, heap.top());
    heap.pop();
  }
  EXPECT_TRUE(queue.is_empty());
}

TEST(RadixQueue, GivesTheEarliestFirst) {
  compare_with_a_heap(0, 1);
  compare_with_a_heap(-1, 1e-3);
  compare_with_a_heap(-1e6, 1e6);
  compare_with_a_heap(1e9, 1e-3);
}

TEST(RadixQueue, KeepsWhatBelongsToATime) {
  RadixQueue queue;
  queue.push({2, 3, 4});
  queue.push({-0.0, 5, 6});
  EXPECT_EQ(queue.pop().a, 5);
  EXPECT_EQ(queue.pop().b, 4);
}

TEST(RadixQueue, IsAsNewAfterClear) {
  RadixQueue queue;
  queue.push({7, 0, 0});
  queue.push({8, 0, 0});
  queue.pop();
  queue.clear();
  EXPECT_TRUE(queue.is_empty());
  queue.push({-3, 1, 1});
  EXPECT_EQ(queue.pop().time, -3);
}

}  // namespace
}  // namespace dyop::toi_internal
