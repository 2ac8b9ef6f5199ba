// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "check/trusted/hdf5_table.h"
#include "check/trusted/shape.h"
#include "check/trusted/shape_reader.h"

/// The tools of a recorded haptic run, what they must keep away from, and every motion
/// (docs/formats.md, "Recordings of a haptic run"). TRUSTED.
namespace dyop_check {

/// A rigid part of a tool: all that is fixed to its frame T, or to one of its hinges.
struct ToolPart {
  std::string name;
  std::size_t tool = 0;
  std::optional<std::size_t> hinge;  ///< of the tool
  Pose X_TJ;                         ///< of the hinge, which turns about its z axis
  std::shared_ptr<const Body> shape;
};

/// What a surface that deforms goes to next.
struct Snapshot {
  std::vector<Vec> vertices;
  std::vector<std::int32_t> corners;  ///< of another mesh, which it is at once; empty: of the same
};

/// The formula of tissue that breathes.
struct Breathing {
  struct Cut {
    std::int64_t number = 0;
    std::vector<std::int32_t> corners;
  };
  double frequency = 0;
  double period = 0;  ///< of snapshots
  Vec amplitude;
  std::vector<Cut> cuts;
};

struct Obstacle {
  std::string name;
  bool is_hard = false;  ///< tools must keep the margin
  double margin = 0;
  Pose X_WO;                          ///< of a rigid one
  std::shared_ptr<const Body> shape;  ///< the same
  bool deforms = false;
  std::vector<Vec> vertices;  ///< of one that deforms, at the start, in world
  std::vector<std::int32_t> corners;
  std::optional<Breathing> formula;
};

/// Where everything is after a motion that began where the waypoint before was.
struct Waypoint {
  struct Tool {
    Pose X_WT;
    std::vector<double> angles;
  };
  struct Progress {
    std::int64_t snapshot = 0;
    double fraction = 1;
  };
  std::int64_t tick = 0;
  bool is_start = false;  ///< of a stretch: nothing leads here from the waypoint before
  std::vector<Tool> tools;
  std::vector<Progress> progress;  ///< of each obstacle that deforms
};

enum class Excuse { None, Leaving, Crossing };  ///< by what a tick's status admits

class HapticRecording {
 public:
  /// @throws BadFile, as all that follows.
  explicit HapticRecording(const Hdf5Reader& file);

  std::vector<ToolPart> parts;
  std::vector<Obstacle> obstacles;
  double tool_margin = 0;  ///< between tools
  std::size_t tool_count = 0;
  bool is_complete = false;  ///< the run has ended in order
  std::int64_t tick_count = 0;
  std::int64_t missing_ticks = 0;  ///< that the log was too slow for

  std::size_t waypoint_count() const { return waypoint_ticks_.size(); }
  Waypoint waypoint(std::size_t number) const;
  /// What the run itself says of a tool in a tick; of bad input what it said before or says next.
  Excuse excuse(std::int64_t tick, std::size_t tool) const;
  /// @param number From 1. None: the file does not have it.
  std::optional<Snapshot> snapshot(std::size_t obstacle, std::int64_t number) const;
  /// Whether it may set out from this part of the motion to the one before.
  bool sets_out_at(double part, std::size_t obstacle, std::int64_t number) const;
  /// Whether all ticks between two are there.
  bool is_whole(std::int64_t first, std::int64_t last) const;

 private:
  struct Rows {
    std::uint64_t first = 0;
    std::uint64_t count = 0;
  };
  using RowsByNumber = std::map<std::pair<std::uint64_t, std::uint64_t>, Rows>;

  void read_session();
  void read_turns();
  void read_tool(const Json& json, const ShapeReader& shapes);
  void read_obstacle(const Json& json, const ShapeReader& shapes);
  void read_waypoints();
  void read_ticks();
  void require_same_ends(const std::vector<std::uint64_t>& numbers) const;
  void require_same_ends(const std::vector<std::uint64_t>& numbers, const std::string& column,
                         std::size_t width, std::size_t rest, const std::vector<double>& ends,
                         double tolerance) const;
  RowsByNumber read_rows(const char* table, const char* first, const char* count) const;

  const Hdf5Reader& file_;
  bool tells_turns_ = false;
  std::map<std::pair<std::uint64_t, std::uint64_t>, double> turns_;  // by obstacle and snapshot
  std::vector<std::size_t> first_angle_;  // by tool, and the end of the last one's
  std::size_t deforming_ = 0;
  std::vector<std::uint64_t> waypoint_ticks_, is_start_, snapshots_;
  std::vector<double> p_, q_, angles_, fractions_;
  std::map<std::int64_t, std::vector<Excuse>> excuses_;
  RowsByNumber snapshot_rows_, mesh_rows_;
};

}  // namespace dyop_check
