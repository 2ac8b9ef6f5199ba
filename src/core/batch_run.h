// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <cstddef>
#include <functional>
#include <stop_token>

#include "dyop/core/batch_options.h"
#include "dyop/core/export.h"

namespace dyop::core_internal {

/// A token that is stopped as soon as either of two is.
class EitherStop {
 public:
  EitherStop(const std::stop_token& x, const std::stop_token& y)
      : on_x_(x, Request{source_}), on_y_(y, Request{source_}) {}

  std::stop_token token() const { return source_.get_token(); }

 private:
  struct Request {
    std::stop_source source;
    void operator()() { source.request_stop(); }
  };
  std::stop_source source_;
  std::stop_callback<Request> on_x_;
  std::stop_callback<Request> on_y_;
};

/// The largest number of items that run_batch() runs at the same time, at least one.
/// Throws InvalidArgument if thread_count is negative.
DYOP_EXPORT std::size_t batch_worker_count(std::size_t item_count, const BatchOptions& options);

/// Calls item(index, worker) for every index below item_count, on the threads that the options
/// allow. Concurrent calls have different workers, below batch_worker_count(), so memory can be
/// kept per worker.
///
/// Indices are handed out one at a time in rising order, until a stop is requested or an item or
/// the progress callback throws. Of several exceptions the one of the lowest index is rethrown, for
/// any number of threads; an InvalidArgument thrown by an item is prefixed with "query <index>: ".
DYOP_EXPORT void run_batch(std::size_t item_count, const BatchOptions& options,
                           const std::function<void(std::size_t index, std::size_t worker)>& item);

/// run_batch() for items so short that handing one out would cost as much as running it: a worker
/// takes 256 at a time, and progress is reported after each such portion.
DYOP_EXPORT void run_batch_in_portions(std::size_t item_count, const BatchOptions& options,
                                       const std::function<void(std::size_t index)>& item);

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
