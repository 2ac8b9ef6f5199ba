// SPDX-License-Identifier: BSD-3-Clause
#include "cli/tool/tool_summary.h"

#include <cstdio>

namespace dyop::cli {

void print_summary(const ToolSummary& summary, std::span<const ToolObstacle> obstacles) {
  for (const auto& [status, count] : summary.statuses) {
    std::printf("  %s: %.1f %%\n", words_of(status), 100.0 * double(count) / double(summary.ticks));
  }
  std::printf("  largest force %.3g", summary.largest_force);
  if (summary.longest_lag > 0) std::printf(", tissue behind by %.3g s", summary.longest_lag);
  std::printf("\n");
  for (std::size_t k = 0; k < summary.least_clearance.size(); ++k) {
    const ToolObstacle& obstacle = obstacles[k];
    std::printf("  never nearer than %.3g to %s", summary.least_clearance[k],
                obstacle.name.c_str());
    if (obstacle.margin > 0) std::printf(" (margin %.3g)", obstacle.margin);
    std::printf("\n");
  }
}

void print_latency(const LatencyHistogram& latency) {
  const auto microseconds = [](std::chrono::nanoseconds time) {
    return double(time.count()) / 1e3;
  };
  std::printf("latency in us: median %.0f, 99 %% %.0f, 99.9 %% %.0f, worst %.0f\n",
              microseconds(latency.quantile(0.5)), microseconds(latency.quantile(0.99)),
              microseconds(latency.quantile(0.999)), microseconds(latency.worst()));
}

}  // namespace dyop::cli
