// SPDX-License-Identifier: BSD-3-Clause
#include "cli/tool/tool_summary.h"

#include <cstdio>

#include "cli/console.h"

namespace dyop::cli {
namespace {

// A lower bound below the margin is no breach: it may be loose, as that of a tick that was cut off.
void print_clearance(Scalar least, std::int64_t breaches, Scalar margin, const std::string& to) {
  const std::string shown = printable(to);
  const char* name = shown.c_str();
  if (breaches > 0) {
    std::printf("nearer than the margin %.3g to %s in %lld ticks, never nearer than %.3g\n", margin,
                name, static_cast<long long>(breaches), least);
  } else if (least < margin) {
    std::printf("could not decide whether nearer than the margin %.3g to %s; than %.3g: never\n",
                margin, name, least);
  } else if (margin > 0) {
    std::printf("never nearer than %.3g to %s (margin %.3g)\n", least, name, margin);
  } else if (least > 0) {
    std::printf("never nearer than %.3g to %s\n", least, name);
  } else {
    std::printf("could not decide whether it touched %s\n", name);
  }
}

void print_tool(const ToolSummary& summary, const HapticScene& scene, const char* indent) {
  for (const auto& [status, count] : summary.statuses) {
    std::printf("%s%s: %.1f %%\n", indent, words_of(status),
                100.0 * double(count) / double(summary.ticks));
  }
  std::printf("%slargest force %.3g", indent, summary.largest_force);
  if (summary.tissue_stopped > 0) {
    std::printf(", tissue stopped for %.3g s in all", summary.tissue_stopped);
  }
  if (summary.longest_lag > 0) {
    std::printf(", at most %.3g s behind its newest snapshot", summary.longest_lag);
  }
  if (summary.farthest_behind > 0) {
    std::printf(", tissue up to %.3g s behind the session's time", summary.farthest_behind);
  }
  std::printf("\n");
  for (std::size_t k = 0; k < summary.least_clearance.size(); ++k) {
    const ToolObstacle& obstacle = scene.obstacles[k];
    std::printf("%s", indent);
    print_clearance(summary.least_clearance[k], summary.breaches[k], obstacle.margin,
                    obstacle.name);
  }
}

}  // namespace

void RunSummary::add(const TickRecord& record) {
  tools.resize(1 + record.others.size());
  tools[0].add(record.tick);
  tools[0].add_tissue(record.tick);
  for (std::size_t k = 1; k < tools.size(); ++k) tools[k].add(record.tick_of(k));
  between.add_clearances(record.tool_clearances());
}

void print_summary(const RunSummary& summary, const HapticScene& scene) {
  if (summary.tools.size() == 1) return print_tool(summary.tools[0], scene, "  ");
  std::size_t pair = 0;
  for (std::size_t k = 0; k < summary.tools.size(); ++k) {
    std::printf("  tool %zu\n", k + 1);
    print_tool(summary.tools[k], scene, "    ");
    for (std::size_t other = 0; other < k; ++other, ++pair) {
      std::printf("    ");
      print_clearance(summary.between.least_clearance[pair], summary.between.breaches[pair],
                      scene.tool_margin, "tool " + std::to_string(other + 1));
    }
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
