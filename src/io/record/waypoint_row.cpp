// SPDX-License-Identifier: BSD-3-Clause
#include "io/record/waypoint_row.h"

#include <algorithm>

#include "dyop/core/error.h"

namespace dyop::io_internal {
namespace {

std::size_t deforming_count(const HapticScene& scene) {
  return std::size_t(std::ranges::count_if(
      scene.obstacles, [](const ToolObstacle& obstacle) { return obstacle.shape == nullptr; }));
}

}  // namespace

WaypointRow::WaypointRow(const HapticScene& scene)
    : snapshot(deforming_count(scene)), fraction(snapshot.size()) {
  for (const HapticTool& tool : scene.tools()) {
    p.resize(p.size() + 3);
    q.resize(q.size() + 4);
    angles.resize(angles.size() + tool.hinges.size());
  }
}

bool WaypointRow::has_same_tools(const WaypointRow& other) const {
  return p == other.p && q == other.q && angles == other.angles;
}

bool WaypointRow::is_same_place(const WaypointRow& other) const {
  return has_same_tools(other) && snapshot == other.snapshot && fraction == other.fraction;
}

WaypointRows::WaypointRows(const HapticScene& scene)
    : obstacles_(scene.obstacles.size()), row_(scene), last_(scene) {
  for (const HapticTool& tool : scene.tools()) hinges_.push_back(tool.hinges.size());
  for (std::size_t k = 0; k < obstacles_; ++k) {
    if (!scene.obstacles[k].shape) deforming_.push_back(k);
  }
}

void WaypointRows::put(const TickRecord& record, std::size_t waypoint) {
  row_.tick = std::uint32_t(record.number);
  row_.is_start = 0;
  row_.time = record.tick.path[waypoint].time;
  auto p = row_.p.begin(), q = row_.q.begin(), angle = row_.angles.begin();
  for (std::size_t tool = 0; tool < hinges_.size(); ++tool) {
    const std::vector<ToolWaypoint>& path = record.tick_of(tool).path;
    DYOP_REQUIRE(path.size() == record.tick.path.size(), "the path of tool ", tool, " has ",
                 path.size(), " waypoints, that of the first tool ", record.tick.path.size());
    const ToolPose& pose = path[waypoint].tool;
    const Vector3& p_WT = pose.X_WT.translation();
    const Quaternion q_WT = pose.X_WT.quaternion();
    p = std::copy_n(p_WT.data(), 3, p);
    q = std::copy_n(q_WT.coeffs().data(), 4, q);
    angle = std::copy_n(pose.angles.begin(), hinges_[tool], angle);
  }
  put_progress(std::span(record.tick.path_progress).subspan(waypoint * obstacles_, obstacles_));
}

void WaypointRows::put_progress(std::span<const ObstacleProgress> obstacles) {
  for (std::size_t k = 0; k < deforming_.size(); ++k) {
    row_.snapshot[k] = std::uint32_t(obstacles[deforming_[k]].snapshot);
    row_.fraction[k] = obstacles[deforming_[k]].fraction;
  }
}

void WaypointRows::append_row(std::vector<char>& out) {
  row_.append_to(out);
  last_ = row_;
  has_rows_ = true;
}

std::int64_t WaypointRows::append(const TickRecord& record, std::vector<char>& out) {
  const std::size_t waypoints = record.tick.path.size();
  DYOP_REQUIRE(record.tick.path_progress.size() == waypoints * obstacles_, "a tick of ", waypoints,
               " waypoints tells where ", record.tick.path_progress.size(), " obstacles were, not ",
               waypoints * obstacles_);
  const bool follows = has_rows_ && record.number == last_tick_ + 1;
  last_tick_ = record.number;
  std::int64_t rows = 0;
  for (std::size_t k = 0; k < waypoints; ++k) {
    put(record, k);
    if (k == 0) {
      if (follows && row_.is_same_place(last_)) continue;
      row_.is_start = !(follows && row_.has_same_tools(last_));
    }
    append_row(out);
    ++rows;
  }
  // A snapshot or mesh that was taken after the last motion.
  if (waypoints > 0 && record.tick.progress.size() == obstacles_) {
    put_progress(record.tick.progress);
    if (!row_.is_same_place(last_)) {
      row_.is_start = 0;
      append_row(out);
      ++rows;
    }
  }
  return rows;
}

}  // namespace dyop::io_internal
