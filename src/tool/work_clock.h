// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <limits>
#include <optional>

#include "dyop/core/interrupt.h"
#include "dyop/toi/time_of_impact.h"
#include "dyop/tool/tool_tick.h"

namespace dyop::internal {

/// Decides where a tick ends early: at its deadline, or where an earlier run was cut off. Every
/// call is a checkpoint; the order of the calls depends on the inputs alone.
class WorkClock final : public Interrupt {
 public:
  using Deadline = std::optional<std::chrono::steady_clock::time_point>;

  void start(const Deadline& deadline);
  void start(const std::optional<TickCutoff>& cutoff);

  /// To be called before every stage.
  bool is_over() override;
  /// The same for small pieces of work, each shorter than reading the clock eight times: it is read
  /// for every eighth of them only.
  bool is_over_small();
  /// Hands the rest of the budget to a query, right after is_over() said no.
  void lend(ToiOptions& options) const;
  /// Records how the query ended.
  void take_back(const ToiResult& result);

  const std::optional<TickCutoff>& cutoff() const { return cutoff_; }
  std::int64_t checkpoints() const { return checkpoint_; }

 private:
  Deadline deadline_;
  std::optional<TickCutoff> wanted_;  // of a replay
  std::optional<TickCutoff> cutoff_;
  bool check(bool reads_clock);

  std::int64_t checkpoint_ = 0;
};

/// A share of a tick's work: over when the clock says so, or after so many checkpoints.
class WorkShare {
 public:
  explicit WorkShare(WorkClock& of_tick) : clock(of_tick) {}
  WorkShare(WorkClock& of_tick, std::int64_t checkpoints)
      : clock(of_tick), end_(clock.checkpoints() + checkpoints) {}

  bool is_over() { return is_used_up() || clock.is_over(); }
  bool is_over_small() { return is_used_up() || clock.is_over_small(); }

  WorkClock& clock;

 private:
  bool is_used_up() const { return clock.checkpoints() >= end_; }

  std::int64_t end_ = std::numeric_limits<std::int64_t>::max();
};

}  // namespace dyop::internal
