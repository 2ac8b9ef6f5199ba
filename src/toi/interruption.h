// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>

#include "dyop/toi/time_of_impact.h"

namespace dyop::toi_internal {

/// What can end a search undecided: its budget, its deadline or its stop token.
class Interruption {
 public:
  /// How often the clock and the stop token are checked, in node pairs.
  static constexpr std::int64_t kPollInterval = 16;

  explicit Interruption(const ToiOptions& options) : options_(options) {}

  /// Call this before every node pair, or after a portion of them.
  std::optional<ToiStatus> after(std::int64_t node_pairs) {
    if (node_pairs >= options_.max_node_pairs) {
      status_ = ToiStatus::BudgetExhausted;
    } else if (node_pairs >= next_poll_) {
      next_poll_ = node_pairs + kPollInterval;
      status_ = from_outside();
    }
    return status_;
  }
  /// The last result of after().
  std::optional<ToiStatus> status() const { return status_; }

  /// How many node pairs may be processed before the next check.
  std::int64_t portion(std::int64_t node_pairs) const {
    return std::min(kPollInterval, options_.max_node_pairs - node_pairs);
  }

 private:
  // Checks the clock and the stop token.
  std::optional<ToiStatus> from_outside() const {
    if (options_.stop.stop_requested()) return ToiStatus::Cancelled;
    if (options_.deadline && std::chrono::steady_clock::now() >= *options_.deadline) {
      return ToiStatus::BudgetExhausted;
    }
    return std::nullopt;
  }

  const ToiOptions& options_;
  std::int64_t next_poll_ = 0;
  std::optional<ToiStatus> status_;
};

}  // namespace dyop::toi_internal
