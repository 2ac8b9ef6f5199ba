// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "cli/commands.h"
#include "dyop/io/haptic_scene_file.h"

/// What needs HDF5: without it every function throws FileError, which names the package.
namespace dyop::cli {

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
                                             const HapticRun& run);

/// Runs the ticks of a recording again and says whether they are the same.
ExitCode replay_tool(const std::filesystem::path& file);

/// Prints what a recording of a tool holds.
ExitCode print_haptic_recording(const std::filesystem::path& file, bool is_json);

}  // namespace dyop::cli
