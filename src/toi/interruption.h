// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>

#include "dyop/toi/time_of_impact.h"

namespace dyop::internal {

/// What makes a search end undecided: its budget, its deadline or its stop token.
class Interruption {
 public:
  /// How often the clock and the stop token are looked at, in node pairs.
  static constexpr std::int64_t kPollInterval = 64;

  explicit Interruption(const ToiOptions& options) : options_(options) {}

  /// To be asked before every node pair, or after a portion of them.
  std::optional<ToiStatus> after(std::int64_t node_pairs) {
    if (node_pairs >= options_.max_node_pairs) {
      status_ = ToiStatus::BudgetExhausted;
    } else if (node_pairs >= next_poll_) {
      next_poll_ = node_pairs + kPollInterval;
      status_ = from_outside();
    }
    return status_;
  }
  /// What was last said.
  std::optional<ToiStatus> status() const { return status_; }

  /// How many node pairs may be taken before the next question.
  std::int64_t portion(std::int64_t node_pairs) const {
    return std::min(kPollInterval, options_.max_node_pairs - node_pairs);
  }

 private:
  // Of the clock and the caller.
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

}  // namespace dyop::internal
