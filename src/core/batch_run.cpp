// SPDX-License-Identifier: BSD-3-Clause
#include "core/batch_run.h"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <limits>
#include <mutex>

#include "dyop/core/error.h"

namespace dyop::core_internal {
namespace {

using BatchItem = std::function<void(std::size_t, std::size_t)>;

// State shared by the workers of one batch.
class BatchRun {
 public:
  BatchRun(std::size_t item_count, const BatchOptions& options, const BatchItem& item)
      : item_count_(item_count), options_(options), item_(item) {
    is_ready_.store(true, std::memory_order_release);
  }

  /// Runs items until none is left.
  void work(std::size_t worker) {
    if (!is_ready_.load(std::memory_order_acquire)) return;  // always true, see is_ready_
    run_items(worker);
    ended_.fetch_add(1, std::memory_order_release);
  }

  /// Call this when all workers have finished.
  void rethrow_failure() const {
    ended_.load(std::memory_order_acquire);
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  void run_items(std::size_t worker) {
    while (!is_failed_ && !options_.stop.stop_requested()) {
      const std::size_t index = next_++;
      if (index >= item_count_) return;
      try {
        run_item(index, worker);
        report_progress();
      } catch (...) {
        keep_failure(index);
      }
    }
  }

  void run_item(std::size_t index, std::size_t worker) const {
    try {
      item_(index, worker);
    } catch (const InvalidArgument& error) {
      throw InvalidArgument(compose_message("query ", index, ": ", error.what()));
    }
  }

  void report_progress() {
    if (!options_.progress) return;
    const std::lock_guard lock(mutex_);
    ++done_;
    // Isolated: a callback that waits for parallel work of its own must not be given an item here,
    // which would wait for the lock that the callback holds.
    tbb::this_task_arena::isolate([&] { options_.progress(done_, item_count_); });
  }

  // All items before a failed one have been handed out and will run, so the lowest is always found.
  void keep_failure(std::size_t index) {
    const std::lock_guard lock(mutex_);
    if (index < failed_index_) {
      failed_index_ = index;
      failure_ = std::current_exception();
    }
    is_failed_ = true;
  }

  const std::size_t item_count_;
  const BatchOptions& options_;
  const BatchItem& item_;
  // oneTBB already makes the caller's memory visible to the workers, and theirs to the caller.
  // These two repeat it where a thread sanitizer can see it.
  std::atomic<bool> is_ready_{false};
  std::atomic<std::size_t> ended_{0};
  std::atomic<std::size_t> next_{0};
  std::atomic<bool> is_failed_{false};
  std::mutex mutex_;  // guards the members below
  std::size_t done_ = 0;
  std::size_t failed_index_ = std::numeric_limits<std::size_t>::max();
  std::exception_ptr failure_;
};

}  // namespace

std::size_t batch_worker_count(std::size_t item_count, const BatchOptions& options) {
  DYOP_REQUIRE(options.thread_count >= 0, "batch: thread_count must be >= 0, not ",
               options.thread_count);
  const std::size_t available =
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  const auto wanted = static_cast<std::size_t>(options.thread_count);
  const std::size_t threads = wanted == 0 ? available : std::min(wanted, available);
  return std::max<std::size_t>(1, std::min(threads, item_count));
}

void run_batch(std::size_t item_count, const BatchOptions& options, const BatchItem& item) {
  const std::size_t workers = batch_worker_count(item_count, options);
  BatchRun run(item_count, options, item);
  if (workers == 1) {
    run.work(0);
  } else {
    run_workers(run, workers);
  }
  run.rethrow_failure();
}

void run_batch_in_portions(std::size_t item_count, const BatchOptions& options,
                           const std::function<void(std::size_t index)>& item) {
  constexpr std::size_t kPortion = 256;
  BatchOptions in_portions = options;
  if (options.progress) {
    in_portions.progress = [&](std::size_t done, std::size_t) {
      options.progress(std::min(done * kPortion, item_count), item_count);
    };
  }
  run_batch((item_count + kPortion - 1) / kPortion, in_portions,
            [&](std::size_t portion, std::size_t) {
              const std::size_t end = std::min((portion + 1) * kPortion, item_count);
              for (std::size_t i = portion * kPortion; i < end; ++i) item(i);
            });
}

}  // namespace dyop::core_internal
