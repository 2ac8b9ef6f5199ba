// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dyop/haptics/haptic_runner.h"
#include "io/record/number_row.h"

namespace dyop::io_internal {

/// A row of /waypoints: where all tools and all obstacles that deform are at the end of a motion.
struct WaypointRow : NumberRow<WaypointRow> {
  explicit WaypointRow(const HapticScene& scene);

  std::uint32_t tick = 0;
  std::uint8_t is_start = 0;  ///< no motion from the row before leads here
  double time = 0;            ///< since the start of the tick
  std::vector<double> p;      ///< of each tool
  std::vector<double> q;      ///< x, y, z, w
  std::vector<double> angles;
  std::vector<std::uint32_t> snapshot;  ///< of each obstacle that deforms
  std::vector<double> fraction;

  /// Whether everything is at the same place.
  bool is_same_place(const WaypointRow& other) const;
  /// Whether every tool is.
  bool has_same_tools(const WaypointRow& other) const;

  template <typename Row, typename Visit>
  static void for_each(Row& row, Visit visit) {
    visit("tick", numbers_of(row.tick));
    visit("is_start", numbers_of(row.is_start));
    visit("time", numbers_of(row.time));
    visit("p", numbers_of(row.p));
    visit("q", numbers_of(row.q));
    visit("angles", numbers_of(row.angles));
    visit("snapshot", numbers_of(row.snapshot));
    visit("fraction", numbers_of(row.fraction));
  }
};

/// The rows of one tick after the other.
class WaypointRows {
 public:
  explicit WaypointRows(const HapticScene& scene);

  const WaypointRow& row() const { return row_; }
  /// Appends the rows of a tick: one for each of its motions, and others for its start and its end
  /// where they are not where the row before left everything.
  /// @return How many.
  std::int64_t append(const TickRecord& record, std::vector<char>& out);

 private:
  void put(const TickRecord& record, std::size_t waypoint);
  void put_progress(std::span<const ObstacleProgress> obstacles);
  void append_row(std::vector<char>& out);

  std::vector<std::size_t> hinges_;     // by tool
  std::vector<std::size_t> deforming_;  // obstacles
  std::size_t obstacles_;
  WaypointRow row_;
  WaypointRow last_;
  std::int64_t last_tick_ = -1;  // that was appended
  bool has_rows_ = false;
};

}  // namespace dyop::io_internal
