// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <limits>
#include <optional>

#include "dyop/core/batch_options.h"
#include "dyop/haptics/haptic_tick.h"
#include "dyop/toi/time_of_impact.h"

namespace dyop::haptics_internal {

/// Decides where a tick ends early: at its deadline, after so much work, or where an earlier run
/// was cut off. Every call is a checkpoint; the order of the calls depends on the inputs alone, and
/// so does the work.
class WorkClock final : public Interrupt {
 public:
  using Deadline = std::optional<std::chrono::steady_clock::time_point>;

  /// @param most_work Of a tick, in small pieces; without it only what start() says ends one.
  explicit WorkClock(std::int64_t most_work = kNoLimit) : most_work_(most_work) {}

  void start(const Deadline& deadline);
  void start(const std::optional<TickCutoff>& cutoff);

  /// To be called before every stage.
  bool is_over() override;
  /// The same for small pieces of work, each not much longer than reading the clock: it is read
  /// for every second of them only.
  bool is_over_small();
  /// Hands the rest of the budget to a query, right after is_over() said no.
  void lend(ToiOptions& options) const;
  /// Records how the query ended.
  void take_back(const ToiResult& result);
  /// So many small pieces of work have been done besides those asked about.
  void add_work(std::int64_t pieces) { work_ += pieces; }

  const std::optional<TickCutoff>& cutoff() const { return cutoff_; }
  std::int64_t checkpoints() const { return checkpoint_; }
  /// Small pieces, as far as they were asked about or added.
  std::int64_t work() const { return work_; }

 private:
  static constexpr std::int64_t kNoLimit = std::numeric_limits<std::int64_t>::max();

  bool check(std::int64_t pieces, bool reads_clock);

  std::int64_t most_work_;
  Deadline deadline_;
  std::optional<TickCutoff> wanted_;  // of a replay
  std::optional<TickCutoff> cutoff_;
  std::int64_t checkpoint_ = 0;
  std::int64_t work_ = 0;
};

/// A share of a tick's work: over when the clock says so, or after so many checkpoints.
class WorkShare {
 public:
  explicit WorkShare(WorkClock& of_tick) : clock(of_tick) {}
  WorkShare(WorkClock& of_tick, std::int64_t checkpoints)
      : clock(of_tick), end_(clock.checkpoints() + checkpoints) {}

  bool is_over() { return is_used_up() || clock.is_over(); }
  bool is_over_small() { return is_used_up() || clock.is_over_small(); }
  bool is_used_up() const { return clock.checkpoints() >= end_; }

  WorkClock& clock;

 private:
  std::int64_t end_ = std::numeric_limits<std::int64_t>::max();
};

}  // namespace dyop::haptics_internal
