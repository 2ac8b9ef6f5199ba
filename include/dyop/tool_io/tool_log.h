// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "dyop/tool/tool_runner.h"
#include "dyop/tool_io/tool_scene_file.h"

namespace DYOP_EXPORT dyop {

/// Appends ticks to a file: the scene once, then for each tick its exact inputs (device, dt, number
/// of snapshots given, where a deadline cut it off) and its results. Snapshots themselves are not
/// stored: the scene defines them. Bytes of a tick: 130 + 16 for each hinge and 9 for
/// each obstacle, and 16 if it was cut off.
class ToolLogWriter {
 public:
  /// @throws FileError if the file cannot be written, as all members do.
  ToolLogWriter(const std::filesystem::path& file, const ToolRun& run);

  void add(const TickRecord& record);
  void close();

  std::int64_t bytes_of_ticks() const { return bytes_of_ticks_; }

 private:
  std::filesystem::path file_;
  std::ofstream out_;
  std::string buffer_;
  std::size_t hinge_count_ = 0;
  std::vector<std::int64_t> snapshots_;
  std::int64_t bytes_of_ticks_ = 0;
};

/// Result of a replay: the number of ticks, and the first that differs.
struct ToolReplay {
  std::int64_t ticks = 0;
  std::int64_t differing = 0;
  std::optional<std::int64_t> first_difference;
};

/// Runs the ticks of a log again from their inputs alone, and compares tool poses, forces and
/// statuses with the log, bit for bit.
/// @param scene_file Path of the scene: its meshes are searched for beside it.
/// @throws FileError if the file is not a log or is truncated.
ToolReplay replay_tool_log(const std::filesystem::path& file,
                           const std::filesystem::path& scene_file);

}  // namespace dyop
