// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <cstddef>

namespace dyop::core_internal {

/// Calls run.work(0) ... run.work(count - 1) on up to `count` threads of the caller's arena: one of
/// its own for each call would leave several kB behind (oneTBB 2021.8 frees no arena that had
/// workers). Isolated, so that a caller who waits here takes no other work. In a file of its own so
/// that thread sanitizers can be told about it (tests/tsan_suppressions.txt).
template <typename Run>
void run_workers(Run& run, std::size_t count) {
  tbb::this_task_arena::isolate([&] {
    // Each task has its own copy.
    const auto work = [shared = &run](std::size_t worker) { shared->work(worker); };
    tbb::parallel_for(std::size_t{0}, count, work, tbb::simple_partitioner());
  });
}

}  // namespace dyop::core_internal
