#pragma once

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

  /// To be asked before every node pair.
  std::optional<ToiStatus> after(std::int64_t node_pairs) {
    if (node_pairs >= options_.max_node_pairs) return ToiStatus::BudgetExhausted;
    if (node_pairs < next_poll_) return std::nullopt;
    next_poll_ = node_pairs + kPollInterval;
    return from_outside();
  }

  /// Of the clock and the caller alone; to be asked every kPollInterval pairs.
  std::optional<ToiStatus> from_outside() const {
    if (options_.stop.stop_requested()) return ToiStatus::Cancelled;
    if (options_.deadline && std::chrono::steady_clock::now() >= *options_.deadline) {
      return ToiStatus::BudgetExhausted;
    }
    return std::nullopt;
  }

 private:
  const ToiOptions& options_;
  std::int64_t next_poll_ = 0;
};

}  // namespace dyop::internal
