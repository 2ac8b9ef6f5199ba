// SPDX-License-Identifier: BSD-3-Clause
#include "haptics/work_clock.h"

#include <algorithm>

namespace dyop::haptics_internal {
namespace {

// What a stage counts for, and a node pair of an impact query, in small pieces of work.
constexpr std::int64_t kStage = 8;
constexpr std::int64_t kNodePair = 2;

}  // namespace

void WorkClock::start(const Deadline& deadline) {
  *this = WorkClock(most_work_);
  deadline_ = deadline;
}

void WorkClock::start(const std::optional<TickCutoff>& cutoff) {
  *this = WorkClock(most_work_);
  wanted_ = cutoff;
}

bool WorkClock::is_over() {
  return check(kStage, true);
}

bool WorkClock::is_over_small() {
  constexpr std::int64_t kAskedTogether = 2;
  return check(1, checkpoint_ % kAskedTogether == 0);
}

bool WorkClock::check(std::int64_t pieces, bool reads_clock) {
  if (cutoff_) return true;
  ++checkpoint_;
  const bool is_cut = wanted_ && wanted_->checkpoint == checkpoint_ && wanted_->node_pairs == 0;
  const bool is_late = reads_clock && deadline_ && std::chrono::steady_clock::now() >= *deadline_;
  if (is_cut || is_late || work_ >= most_work_) {
    cutoff_ = {checkpoint_, 0};
  } else {
    work_ += pieces;
  }
  return cutoff_.has_value();
}

void WorkClock::lend(ToiOptions& options) const {
  options.deadline = deadline_;
  options.max_node_pairs = std::min(options.max_node_pairs,
                                    1 + std::max<std::int64_t>(0, most_work_ - work_) / kNodePair);
  if (wanted_ && wanted_->checkpoint == checkpoint_) options.max_node_pairs = wanted_->node_pairs;
}

void WorkClock::take_back(const ToiResult& result) {
  add_work(kNodePair * result.statistics.node_pairs);
  if (result.status != ToiStatus::BudgetExhausted) return;
  cutoff_ = {checkpoint_, result.statistics.node_pairs};
}

}  // namespace dyop::haptics_internal
