// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dyop/haptics/haptic_tick.h"

namespace DYOP_EXPORT dyop {

/// Data of a tool's run, besides its scene and options.
struct HapticRunHeader {
  std::string title;
  std::string scene;    ///< text of the scene file; empty: none
  Scalar period = 0;    ///< of a tick as planned; 0: unknown
  std::string version;  ///< of the dyop that wrote the recording, which sets it
};

/// How the snapshots of a deforming obstacle come into a recording.
struct SnapshotSource {
  std::string formula;  ///< see TissueFeed; empty: their vertices are stored
  Scalar period = 0;    ///< from one snapshot to the next, if there is a formula
};

/// One tick as a recording stores it: its exact inputs, and results for looking at. The digest
/// stands for all bits of the result.
struct RecordedTick {
  std::int64_t number = 0;
  DevicePose device;
  Scalar dt = 0;
  std::optional<TickCutoff> cutoff;
  std::vector<std::uint8_t> new_snapshots;  ///< per obstacle: given since the tick before

  HapticStatus status = HapticStatus::NotRun;
  ToolPose tool;      ///< position exact, rotation and angles in single precision
  ToolWrench wrench;  ///< from here on in single precision
  int contacts = 0;   ///< places that held the proxy; 255: or more
  std::vector<ToolClearance> clearances;  ///< bounds rounded outwards
  /// The obstacle with the least upper bound: only its witness points are stored.
  std::optional<std::size_t> nearest;
  Scalar energy_returned = 0;
  Scalar tissue_stopped = 0;
  Scalar tissue_lag = 0;  ///< not known, 0, in recordings of version 1 and 2
  std::chrono::nanoseconds latency{0};
  TickStatistics statistics;
  std::uint64_t digest = 0;

  /// How far the session advanced: dt, or 0 if dt is invalid.
  Scalar time_passed() const { return dt >= 0 && dt < kInfinity ? dt : 0; }
};

/// How a recorded run ended.
struct HapticRunEnd {
  std::int64_t ticks = 0;
  std::int64_t late_starts = 0;
  std::int64_t unlogged = 0;
  std::string rights;  ///< as RunnerReport
  std::string error;   ///< message of the error that ended it; empty: none
};

/// A hash of every bit of a tick's results, latency and statistics excepted: equal for equal bits.
std::uint64_t tick_digest(const HapticTick& tick);

}  // namespace dyop
