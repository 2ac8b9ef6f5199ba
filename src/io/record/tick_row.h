// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "dyop/haptics/haptic_runner.h"
#include "dyop/haptics/haptic_session.h"
#include "dyop/io/haptic_recording.h"
#include "io/record/number_row.h"
#include "io/record/recording_rows.h"

namespace dyop::io_internal {

/// Version 2 added the meshes that obstacles go on as; version 3 the time for which tissue was
/// stopped in a tick: before, `tissue_lag` was its sum; version 4 further tools; version 5 the
/// motions within a tick, so that dyop-check can prove them; version 6 all other inputs; version 7
/// how far tissue is behind the session's time. Readers of it read 1 to 6.
constexpr std::int64_t kToolRecordingVersion = 7;
constexpr const char* kToolRecordingFormat = "dyop tool recording";

/// No obstacle.
constexpr std::uint16_t kNoObstacle = 0xffff;

/// How many of each a row has.
struct TickShape {
  TickShape(const HapticScene& scene, std::int64_t version);

  std::int64_t version;  ///< of the file
  std::size_t hinges;    ///< of the first tool
  std::size_t obstacles;
  std::vector<std::size_t> other_hinges;  ///< of each further tool
};

/// A row of /ticks.
struct TickRow : NumberRow<TickRow> {
  explicit TickRow(TickShape shape);

  std::uint32_t number = 0;
  std::uint8_t status = 0;
  std::uint8_t contacts = 0;
  std::uint16_t nearest = kNoObstacle;
  double dt = 0;
  std::array<double, 3> device_p{};
  std::array<double, 4> device_q{};  // x, y, z, w
  std::vector<double> device_angles;
  std::uint32_t cutoff_checkpoint = 0;  // 0: not cut off
  std::uint32_t cutoff_node_pairs = 0;
  std::vector<std::uint8_t> new_snapshots;
  std::array<double, 3> tool_p{};
  std::array<float, 4> tool_q{};
  std::vector<float> tool_angles;
  std::array<float, 3> force{};
  std::array<float, 3> torque{};
  float energy_returned = 0;
  float tissue_lag = 0;
  std::vector<float> tissue_stopped;  // one, or none before version 3
  std::vector<float> tissue_behind;   // one, or none before version 7
  std::vector<float> lower;
  std::vector<float> upper;
  std::vector<float> time_to_breach;
  std::array<float, 3> p_tool{};  // witness points of `nearest`
  std::array<float, 3> p_obstacle{};
  std::uint32_t latency_ns = 0;
  std::uint32_t checkpoints = 0;
  std::uint32_t node_pairs = 0;
  std::uint16_t impact_queries = 0;
  std::uint16_t distance_queries = 0;
  std::uint16_t solves = 0;
  std::uint16_t pieces = 0;
  // Of further tools, one after the other:
  std::vector<std::uint8_t> other_status;
  std::vector<double> other_device_p;
  std::vector<double> other_device_q;  // x, y, z, w
  std::vector<double> other_device_angles;
  std::vector<double> other_tool_p;
  std::vector<float> other_tool_q;
  std::vector<float> other_tool_angles;
  std::vector<float> other_force;
  std::vector<float> other_torque;
  std::vector<float> other_energy_returned;
  std::vector<float> other_lower;  // by tool, then by obstacle
  std::vector<float> other_upper;
  std::vector<float> tools_lower;  // by pair of tools
  std::vector<float> tools_upper;
  std::vector<float> tools_p_second;  // witness points
  std::vector<float> tools_p_first;
  std::uint64_t digest = 0;

  const TickShape& shape() const { return shape_; }

  /// The name in the file is the name of the member.
  template <typename Row, typename Visit>
  static void for_each(Row& row, Visit visit);

 private:
  TickShape shape_;
};

template <typename Row, typename Visit>
void TickRow::for_each(Row& row, Visit visit) {
  visit("number", numbers_of(row.number));
  visit("status", numbers_of(row.status));
  visit("contacts", numbers_of(row.contacts));
  visit("nearest", numbers_of(row.nearest));
  visit("dt", numbers_of(row.dt));
  visit("device_p", numbers_of(row.device_p));
  visit("device_q", numbers_of(row.device_q));
  visit("device_angles", numbers_of(row.device_angles));
  visit("cutoff_checkpoint", numbers_of(row.cutoff_checkpoint));
  visit("cutoff_node_pairs", numbers_of(row.cutoff_node_pairs));
  visit("new_snapshots", numbers_of(row.new_snapshots));
  visit("tool_p", numbers_of(row.tool_p));
  visit("tool_q", numbers_of(row.tool_q));
  visit("tool_angles", numbers_of(row.tool_angles));
  visit("force", numbers_of(row.force));
  visit("torque", numbers_of(row.torque));
  visit("energy_returned", numbers_of(row.energy_returned));
  visit("tissue_lag", numbers_of(row.tissue_lag));
  visit("tissue_stopped", numbers_of(row.tissue_stopped));
  visit("tissue_behind", numbers_of(row.tissue_behind));
  visit("lower", numbers_of(row.lower));
  visit("upper", numbers_of(row.upper));
  visit("time_to_breach", numbers_of(row.time_to_breach));
  visit("p_tool", numbers_of(row.p_tool));
  visit("p_obstacle", numbers_of(row.p_obstacle));
  visit("latency_ns", numbers_of(row.latency_ns));
  visit("checkpoints", numbers_of(row.checkpoints));
  visit("node_pairs", numbers_of(row.node_pairs));
  visit("impact_queries", numbers_of(row.impact_queries));
  visit("distance_queries", numbers_of(row.distance_queries));
  visit("solves", numbers_of(row.solves));
  visit("pieces", numbers_of(row.pieces));
  visit("other_status", numbers_of(row.other_status));
  visit("other_device_p", numbers_of(row.other_device_p));
  visit("other_device_q", numbers_of(row.other_device_q));
  visit("other_device_angles", numbers_of(row.other_device_angles));
  visit("other_tool_p", numbers_of(row.other_tool_p));
  visit("other_tool_q", numbers_of(row.other_tool_q));
  visit("other_tool_angles", numbers_of(row.other_tool_angles));
  visit("other_force", numbers_of(row.other_force));
  visit("other_torque", numbers_of(row.other_torque));
  visit("other_energy_returned", numbers_of(row.other_energy_returned));
  visit("other_lower", numbers_of(row.other_lower));
  visit("other_upper", numbers_of(row.other_upper));
  visit("tools_lower", numbers_of(row.tools_lower));
  visit("tools_upper", numbers_of(row.tools_upper));
  visit("tools_p_second", numbers_of(row.tools_p_second));
  visit("tools_p_first", numbers_of(row.tools_p_first));
  visit("digest", numbers_of(row.digest));
}

/// @param seen Per obstacle: snapshots seen by the tick before; updated.
/// @throws InvalidArgument if a number does not fit.
void put_tick(const TickRecord& record, std::vector<std::int64_t>& seen, TickRow& row);
/// @param row Before version 3 the time for which tissue was stopped is the sum of all ticks.
RecordedTick tick_from(const TickRow& row, const HapticScene& scene);
/// The digest of several ticks, from that of all before the last and that of the last.
inline std::uint64_t joined_digest(std::uint64_t before, std::uint64_t last) {
  constexpr std::uint64_t kOdd = 0x9e3779b97f4a7c15u;  // literal: mixes the order in
  return (before * kOdd) ^ last;
}

// What a HapticSession is made of, as JSON with every bit, and the shapes it names.

/// Whether an obstacle's mesh deforms.
inline bool deforms(const ToolObstacle& obstacle) {
  return obstacle.shape == nullptr;
}

Json springs_json(const CouplingOptions& springs);
CouplingOptions springs_from(const Json& json);

struct SessionText {
  std::string json;
  std::string shapes;  // lines
  ShapeRows rows;
};
SessionText session_text(const HapticScene& scene, const HapticOptions& options,
                         std::span<const TissueFeed> tissue);

struct StoredSession {
  HapticScene scene;
  HapticOptions options;
  std::vector<SnapshotSource> sources;
};
/// @throws InvalidArgument, or an exception of nlohmann, for a text of the wrong form.
StoredSession session_from(const Json& json, std::span<const std::shared_ptr<const Shape>> shapes);

}  // namespace dyop::io_internal
