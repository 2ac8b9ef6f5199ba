// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "dyop/haptics/haptic_runner.h"
#include "dyop/io/haptic_recording.h"

namespace DYOP_EXPORT dyop {

/// What an obstacle was given before a tick.
struct TissueStep {
  std::size_t obstacle = 0;
  std::optional<RecordedTurn> turn = {};   ///< what waited until then does no longer
  const RecordedSnapshot* next = nullptr;  ///< what waits from now on, or null
};

/// The snapshots of a recorded run, wherever they come from.
class RecordedTissue {
 public:
  /// The reader must outlive it.
  /// @throws FileError for a formula that this program does not know.
  explicit RecordedTissue(const HapticRecordingReader& reader, const std::filesystem::path& file);

  /// The next snapshot or mesh of an obstacle.
  /// @throws InvalidArgument if the recording lacks it, FileError if it cannot be read.
  const RecordedSnapshot& next(std::size_t obstacle);

  /// Calls visit(const TissueStep&) for everything that tissue was given before a tick; all ticks
  /// in their order.
  template <typename Visit>
  void for_each_step(const RecordedTick& tick, Visit visit) {
    for (std::size_t k = 0; k < tick.new_snapshots.size(); ++k) {
      if (const TissueStep step = step_of(tick, k); step.turn || step.next) visit(step);
    }
  }

 private:
  TissueStep step_of(const RecordedTick& tick, std::size_t obstacle);

  struct Source {
    std::optional<TissueFeed> feed;
    std::int64_t number = 0;
    RecordedSnapshot last;
  };
  const HapticRecordingReader& reader_;
  std::vector<Source> sources_;
};

/// Result of a replay.
struct HapticReplay {
  std::int64_t ticks = 0;
  std::int64_t differing = 0;
  std::optional<std::int64_t> first_difference;  ///< number of a tick
  std::string recorded_by;                       ///< version of dyop
};

/// Runs the ticks of a recording again from their inputs alone, and compares every bit of their
/// results with the recorded digest (tick_digest()). A tick that its deadline ended is ended at
/// the same place. Other versions of dyop, other compilers and other processors may compute other
/// bits.
/// @param on_tick Called after each tick with its number and result; may be empty.
/// @throws FileError if the file is no recording of a tool, is damaged, or lacks ticks because the
///         log was too slow for the run.
HapticReplay replay_haptic_recording(
    const std::filesystem::path& file,
    const std::function<void(const RecordedTick& recorded, const HapticTick& tick)>& on_tick = {});

}  // namespace dyop
