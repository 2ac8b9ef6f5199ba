// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>

#include "dyop/core/export.h"

namespace DYOP_EXPORT dyop {

namespace toi_internal {
struct ToiMemory;
}

/// Memory of time_of_impact(), kept by the caller between queries: after the first few, queries of
/// two meshes allocate nothing. Also holds the state of a query that ran out of budget, so that it
/// can be resumed. Works with any pair of shapes, one query at a time. A query throws
/// InvalidArgument if the workspace is serving another one, in any thread, or was moved from.
class ToiWorkspace {
 public:
  ToiWorkspace();
  ~ToiWorkspace();
  ToiWorkspace(ToiWorkspace&&) noexcept;
  ToiWorkspace& operator=(ToiWorkspace&&) noexcept;

  /// True if the last query ended undecided (BudgetExhausted, Cancelled) and can be resumed.
  /// @throws InvalidArgument if the workspace was moved from; it can only be assigned then.
  bool can_resume() const;

  /// Grows the memory before the first query: to `count` node pairs in each of the 65 arrays of the
  /// queue, 16 bytes a pair.
  /// @throws InvalidArgument if the workspace was moved from.
  void reserve(std::size_t count);

  toi_internal::ToiMemory& memory() const;

 private:
  std::unique_ptr<toi_internal::ToiMemory> memory_;
};

}  // namespace dyop
