// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <chrono>
#include <memory>
#include <vector>

#include "dyop/toi/time_of_impact.h"
#include "python/glue/arguments.h"
#include "python/glue/interrupt.h"

namespace dyop::python {

/// A workspace that keeps alive what its last query was about, for resuming it.
struct PythonWorkspace {
  ToiWorkspace workspace;
  std::vector<std::shared_ptr<const void>> held;
};

inline constexpr std::int64_t kSlice = 50'000;  // node pairs: some ten milliseconds

/// Adds the work of a further slice of a query.
inline void add_work(ToiStatistics& sum, const ToiStatistics& slice) {
  sum.box_tests += slice.box_tests;
  sum.leaf_tests += slice.leaf_tests;
  sum.node_pairs += slice.node_pairs;
  sum.peak_queue = std::max(sum.peak_queue, slice.peak_queue);
}

/// Answers a query in slices of its budget and serves Ctrl-C between them. The result is the one of
/// the whole budget at once; what is interrupted can be resumed.
/// @param first  Starts the query under other options; `resume` goes on with it.
template <typename First, typename Resume>
ToiResult answer_in_slices(const ToiOptions& options, const First& first, const Resume& resume) {
  const py::gil_scoped_release unlocked;
  ToiOptions slice = options;
  slice.max_node_pairs = std::min(options.max_node_pairs, kSlice);
  ToiResult result = first(slice);
  ToiStatistics work = result.statistics;
  const auto is_over = [&] {
    return result.status != ToiStatus::BudgetExhausted ||
           work.node_pairs >= options.max_node_pairs ||
           (options.deadline && std::chrono::steady_clock::now() >= *options.deadline);
  };
  while (!is_over()) {
    {
      const py::gil_scoped_acquire lock;
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }
    slice.max_node_pairs = std::min(options.max_node_pairs - work.node_pairs, kSlice);
    result = resume(slice);
    add_work(work, result.statistics);
  }
  result.statistics = work;
  return result;
}

/// Answers a query that cannot be resumed: within a slice of its budget in the calling thread, and
/// if that is not enough once more with all of it, while Ctrl-C is served. The result is the one of
/// the whole budget at once.
/// @param toi_of The ToiResult within a result.
template <typename Ask, typename ToiOf>
auto answer_or_start_over(ToiOptions options, const Ask& ask, const ToiOf& toi_of) {
  const std::int64_t budget = options.max_node_pairs;
  options.max_node_pairs = std::min(budget, kSlice);
  auto result = [&] {
    const py::gil_scoped_release unlocked;
    return ask(options);
  }();
  const bool is_late = options.deadline && std::chrono::steady_clock::now() >= *options.deadline;
  const bool is_undecided = toi_of(result).status == ToiStatus::BudgetExhausted;
  if (budget <= kSlice || is_late || !is_undecided) return result;
  options.max_node_pairs = budget;
  run_interruptible(options.stop, [&](const std::stop_token& stop) {
    options.stop = stop;
    result = ask(options);
  });
  return result;
}

}  // namespace dyop::python
