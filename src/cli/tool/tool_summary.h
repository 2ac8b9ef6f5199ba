// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "dyop/haptics/haptic_scene.h"
#include "dyop/haptics/haptic_tick.h"
#include "dyop/haptics/latency_histogram.h"

namespace dyop::cli {

/// What a number of ticks was like.
struct ToolSummary {
  std::int64_t ticks = 0;
  std::map<HapticStatus, std::int64_t> statuses;
  Scalar largest_force = 0;
  Scalar tissue_stopped = 0;
  Scalar longest_lag = 0;               ///< of tissue
  std::vector<Scalar> least_clearance;  ///< per obstacle, proven
  std::vector<std::int64_t> breaches;   ///< per obstacle: ticks that surely ended inside the margin

  /// A HapticTick or a RecordedTick.
  template <typename Tick>
  void add(const Tick& tick) {
    least_clearance.resize(tick.clearances.size(), kInfinity);
    breaches.resize(tick.clearances.size());
    ++ticks;
    ++statuses[tick.status];
    largest_force = std::max(largest_force, tick.wrench.force_W.norm());
    tissue_stopped += tick.tissue_stopped;
    longest_lag = std::max(longest_lag, tick.tissue_lag);
    for (std::size_t k = 0; k < tick.clearances.size(); ++k) {
      least_clearance[k] = std::min(least_clearance[k], tick.clearances[k].lower);
      breaches[k] += tick.clearances[k].is_breached;
    }
  }
};

/// Prints it, each line indented by two.
void print_summary(const ToolSummary& summary, std::span<const ToolObstacle> obstacles);
void print_latency(const LatencyHistogram& latency);

}  // namespace dyop::cli
