// SPDX-License-Identifier: BSD-3-Clause
#include "tool/work_clock.h"

namespace dyop::internal {

void WorkClock::start(const Deadline& deadline) {
  *this = {};
  deadline_ = deadline;
}

void WorkClock::start(const std::optional<TickCutoff>& cutoff) {
  *this = {};
  wanted_ = cutoff;
}

bool WorkClock::is_over() {
  return check(true);
}

bool WorkClock::is_over_small() {
  constexpr std::int64_t kSmallPieces = 8;
  return check(checkpoint_ % kSmallPieces == 0);
}

bool WorkClock::check(bool reads_clock) {
  if (cutoff_) return true;
  ++checkpoint_;
  const bool is_cut = wanted_ && wanted_->checkpoint == checkpoint_ && wanted_->node_pairs == 0;
  const bool is_late = reads_clock && deadline_ && std::chrono::steady_clock::now() >= *deadline_;
  if (is_cut || is_late) cutoff_ = {checkpoint_, 0};
  return cutoff_.has_value();
}

void WorkClock::lend(ToiOptions& options) const {
  options.deadline = deadline_;
  if (wanted_ && wanted_->checkpoint == checkpoint_) options.max_node_pairs = wanted_->node_pairs;
}

void WorkClock::take_back(const ToiResult& result) {
  if (result.status != ToiStatus::BudgetExhausted) return;
  cutoff_ = {checkpoint_, result.statistics.node_pairs};
}

}  // namespace dyop::internal
