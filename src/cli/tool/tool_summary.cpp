// SPDX-License-Identifier: BSD-3-Clause
#include "cli/tool/tool_summary.h"

#include <cstdio>

#include "cli/console.h"

namespace dyop::cli {
namespace {

// A lower bound below the margin is no breach: it may be loose, as that of a tick that was cut off.
void print_clearance(Scalar least, std::int64_t breaches, const ToolObstacle& obstacle) {
  const std::string shown = printable(obstacle.name);
  const char* name = shown.c_str();
  if (breaches > 0) {
    std::printf("  nearer than the margin %.3g to %s in %lld ticks, never nearer than %.3g\n",
                obstacle.margin, name, static_cast<long long>(breaches), least);
  } else if (least < obstacle.margin) {
    std::printf("  could not decide whether nearer than the margin %.3g to %s; than %.3g: never\n",
                obstacle.margin, name, least);
  } else if (obstacle.margin > 0) {
    std::printf("  never nearer than %.3g to %s (margin %.3g)\n", least, name, obstacle.margin);
  } else if (least > 0) {
    std::printf("  never nearer than %.3g to %s\n", least, name);
  } else {
    std::printf("  could not decide whether it touched %s\n", name);
  }
}

}  // namespace

void print_summary(const ToolSummary& summary, std::span<const ToolObstacle> obstacles) {
  for (const auto& [status, count] : summary.statuses) {
    std::printf("  %s: %.1f %%\n", words_of(status), 100.0 * double(count) / double(summary.ticks));
  }
  std::printf("  largest force %.3g", summary.largest_force);
  if (summary.tissue_stopped > 0) {
    std::printf(", tissue stopped for %.3g s in all", summary.tissue_stopped);
  }
  if (summary.longest_lag > 0) {
    std::printf(", at most %.3g s behind its newest snapshot", summary.longest_lag);
  }
  std::printf("\n");
  for (std::size_t k = 0; k < summary.least_clearance.size(); ++k) {
    print_clearance(summary.least_clearance[k], summary.breaches[k], obstacles[k]);
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
