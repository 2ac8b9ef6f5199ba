// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>

#include "dyop/core/batch_options.h"
#include "dyop/core/export.h"

namespace dyop::internal {

/// Largest number of items that run_batch() has under way at once, at least one.
/// Throws InvalidArgument if thread_count is negative.
DYOP_EXPORT std::size_t batch_worker_count(std::size_t item_count, const BatchOptions& options);

/// Calls item(index, worker) for every index below item_count, over the threads that the options
/// allow. Calls under way at the same time have different workers, below batch_worker_count(): so
/// memory can be kept by worker.
///
/// Indices are handed out one at a time in rising order. After a stop is requested, or an item or
/// the progress callback has thrown, no further one is. Of several exceptions that of the lowest
/// index is rethrown, the same for every number of threads; an InvalidArgument thrown by an item
/// gets "query <index>: " in front.
DYOP_EXPORT void run_batch(std::size_t item_count, const BatchOptions& options,
                           const std::function<void(std::size_t index, std::size_t worker)>& item);

}  // namespace dyop::internal
