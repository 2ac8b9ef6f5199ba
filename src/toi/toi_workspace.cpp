// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/toi_workspace.h"

#include "dyop/core/error.h"
#include "toi/toi_memory.h"

namespace dyop {

ToiWorkspace::ToiWorkspace() : memory_(std::make_unique<toi_internal::ToiMemory>()) {}
ToiWorkspace::~ToiWorkspace() = default;
ToiWorkspace::ToiWorkspace(ToiWorkspace&&) noexcept = default;
ToiWorkspace& ToiWorkspace::operator=(ToiWorkspace&&) noexcept = default;

toi_internal::ToiMemory& ToiWorkspace::memory() const {
  DYOP_REQUIRE(memory_, "this ToiWorkspace was moved from and is empty");
  return *memory_;
}

bool ToiWorkspace::can_resume() const {
  return memory().is_unfinished;
}

void ToiWorkspace::reserve(std::size_t count) {
  memory().queue.reserve(count);
  memory().box_pairs.reserve(count);
}

namespace toi_internal {

WorkspaceUse::WorkspaceUse(ToiWorkspace& workspace) : memory_(workspace.memory()) {
  DYOP_REQUIRE(
      !memory_.is_in_use.exchange(true, std::memory_order_acquire),
      "time_of_impact: the workspace is in use by another query; give each thread its own");
}

}  // namespace toi_internal

}  // namespace dyop
