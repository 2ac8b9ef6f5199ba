// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "cli/commands.h"
#include "dyop/haptics/haptic_runner.h"
#include "dyop/haptics/haptic_scene.h"
#include "dyop/haptics/haptic_tick.h"
#include "dyop/io/haptic_scene_file.h"

namespace dyop::cli {

/// What a number of ticks was like.
struct ToolSummary {
  std::int64_t ticks = 0;
  std::map<HapticStatus, std::int64_t> statuses;
  Scalar largest_force = 0;
  Scalar tissue_stopped = 0;
  Scalar longest_lag = 0;               ///< of tissue
  Scalar farthest_behind = 0;           ///< tissue, behind the session's time
  std::vector<Scalar> least_clearance;  ///< per obstacle, proven
  std::vector<std::int64_t> breaches;   ///< per obstacle: ticks that surely ended inside the margin

  /// A HapticTick, a RecordedTick or a RecordedTool.
  template <typename Tick>
  void add(const Tick& tick) {
    ++ticks;
    ++statuses[tick.status];
    largest_force = std::max(largest_force, tick.wrench.force_W.norm());
    add_clearances(tick.clearances);
  }
  /// Of a HapticTick or a RecordedTick.
  template <typename Tick>
  void add_tissue(const Tick& tick) {
    tissue_stopped += tick.tissue_stopped;
    longest_lag = std::max(longest_lag, tick.tissue_lag);
    farthest_behind = std::max(farthest_behind, tick.tissue_behind);
  }
  void add_clearances(std::span<const ToolClearance> clearances) {
    least_clearance.resize(clearances.size(), kInfinity);
    breaches.resize(clearances.size());
    for (std::size_t k = 0; k < clearances.size(); ++k) {
      least_clearance[k] = std::min(least_clearance[k], clearances[k].lower);
      breaches[k] += clearances[k].is_breached;
    }
  }
};

/// What a number of ticks of all tools was like.
struct RunSummary {
  std::vector<ToolSummary> tools;
  /// Between tools, in place of obstacles: one for each pair, (0, 1), (0, 2), (1, 2) and so on.
  ToolSummary between;

  std::int64_t ticks() const { return tools.empty() ? 0 : tools[0].ticks; }
  void add(const TickRecord& record);
};

/// Prints it, each line indented by two, or by four below the name of each of several tools.
void print_summary(const RunSummary& summary, const HapticScene& scene);
void print_latency(const LatencyHistogram& latency);

// What needs HDF5: without it every function throws FileError, which names the package.

/// Where the ticks of a run go.
class ToolOutput {
 public:
  virtual ~ToolOutput() = default;

  virtual void add(const TickRecord& record) = 0;
  /// Both end the recording; the second with the message of what ended the run.
  virtual void finish(const RunnerReport& report) = 0;
  virtual void fail(const std::string& error) = 0;
  virtual std::size_t bytes_per_tick() const = 0;
};

/// A file of docs/formats.md.
std::unique_ptr<ToolOutput> make_tool_output(const std::filesystem::path& file,
                                             const HapticRun& run, HapticSession& session);

/// A page in the browser that follows a run; see ToolFollower.
class LiveTool {
 public:
  virtual ~LiveTool() = default;

  virtual std::string address() const = 0;
  /// Is stopped when the page stops the run.
  virtual std::stop_token stop_token() const = 0;
  virtual void add(const TickRecord& record) = 0;
  virtual void add_snapshot(std::size_t obstacle, std::span<const Vector3> vertices) = 0;
  virtual void add_cut(std::size_t obstacle, const TissueMesh& mesh) = 0;
  /// Says why the run ended.
  virtual void end(const std::string& why) = 0;
};

/// @throws InvalidArgument as LiveServer.
std::unique_ptr<LiveTool> make_live_tool(const HapticRun& run, int port);

/// Runs the ticks of a recording again and says whether they are the same.
ExitCode replay_tool(const std::filesystem::path& file);

/// Prints what a recording of a tool holds.
ExitCode print_haptic_recording(const std::filesystem::path& file, bool is_json);

}  // namespace dyop::cli
