// SPDX-License-Identifier: BSD-3-Clause
#include "tick_check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace dyop::testing {
namespace {

// The tolerance of impacts as a fraction of the rest offset, and what the loop promises to keep
// besides the margin (docs/haptics.md).
constexpr Scalar kTolerance = 0.3;
constexpr Scalar kKept = kTolerance / 4;
constexpr Scalar kTissueNoise = 1e-9;  // literal: rounding of positions of size 300, and of time

// Some checks are made in one of so many ticks.
constexpr std::int64_t kSeldom = 100;
constexpr std::int64_t kNowAndThen = 10;

bool is_hard(const ToolObstacle& obstacle) {
  return obstacle.role == ObstacleRole::Tissue || obstacle.role == ObstacleRole::HardRegion;
}

// Where a tool is after one more tick with the velocity of this one.
ToolPose once_more(const ToolPose& from, const ToolPose& to) {
  const Eigen::AngleAxis<Scalar> turn(
      Matrix3(to.X_WT.rotation() * from.X_WT.rotation().transpose()));
  ToolPose pose = to;
  pose.X_WT = RigidPose(Matrix3(turn.toRotationMatrix() * to.X_WT.rotation()),
                        2 * to.X_WT.translation() - from.X_WT.translation());
  for (std::size_t k = 0; k < kMostHinges; ++k) pose.angles[k] += to.angles[k] - from.angles[k];
  return pose;
}

}  // namespace

bool has_full_promise(Scalar start, Scalar margin, Scalar rest_offset) {
  return start >= margin + kKept * rest_offset;
}

Scalar promised_distance(Scalar start, Scalar margin, Scalar rest_offset) {
  if (has_full_promise(start, margin, rest_offset)) return margin + kKept * rest_offset;
  const Scalar tolerance = std::min(kTolerance * rest_offset, start / 4);
  const Scalar promised = start - 0.75 * tolerance;
  return start >= margin ? std::max(promised, margin) : promised;
}

TickCheck::TickCheck(const HapticScene& scene, const HapticOptions& options, std::size_t tool)
    : tool_(tool), obstacles_(scene.obstacles), options_(options), oracle_(scene.tools().at(tool)) {
  for (const ToolObstacle& obstacle : obstacles_) tissue_.emplace_back(obstacle);
}

bool TickCheck::is_exempt() const {
  const HapticStatus status = tick_->status;
  return status == HapticStatus::Recovering || status == HapticStatus::Overlapping;
}

void TickCheck::tell(const char* what, std::size_t obstacle, Scalar value, Scalar bound) const {
  std::printf("tick %lld, tool %zu, status %d, obstacle %zu: %s %.9g, %.9g\n",
              static_cast<long long>(number_), tool_, static_cast<int>(tick_->status), obstacle,
              what, value, bound);
}

void TickCheck::check(const HapticSession& session, const DevicePose& device, Scalar dt,
                      const SpanStart& beside) {
  tick_ = &session.last(tool_);
  ++number_;
  for (TissuePath& path : tissue_) path.start_tick();
  distance_.assign(tissue_.size(), kInfinity);
  start_ = beside;
  const std::vector<ToolWaypoint>& path = tick_->path;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Scalar length = path[i].time - path[i - 1].time;
    const ToolSpanPath span(path[i - 1].tool, path[i].tool);
    // Lines that end with the motion, but for rounding, go on in the next one.
    const Scalar noise = kTissueNoise * dt;
    Scalar done = 0;
    do {
      Scalar time = length - done;
      for (TissuePath& tissue : tissue_) {
        // Where no time passes tissue stands.
        if (length > 0 && !(tissue.time_left() > noise)) tissue.go_on();
        time = std::min(time, tissue.time_left());
      }
      const Scalar from = length > 0 ? done / length : 0;
      const Scalar to = length > 0 ? (done + time) / length : 1;
      check_part({span, from, std::min(Scalar{1}, to), time});
      for (TissuePath& tissue : tissue_) tissue.pass(time);
      done += time;
    } while (length - done > noise);
  }
  // What is reported is about the meshes of the end, which none of the motions may have seen.
  if (take_over_at_end(session, dt) || path.size() == 1) {
    const ToolSpanPath rest(path.back().tool, path.back().tool);
    check_part({rest, 0, 1, 0});
  }
  check_clearances();
  if (path.size() > 1 && number_ % kNowAndThen == 0) check_time_to_breach(dt);
  check_tissue(session);
  check_status(device, dt);
}

// The session may have begun the next line at the very end of the tick.
// @return Whether one is another mesh.
bool TickCheck::take_over_at_end(const HapticSession& session, Scalar dt) {
  bool has_new_mesh = false;
  for (std::size_t k = 0; k < tissue_.size(); ++k) {
    if (obstacles_[k].shape || tissue_[k].lines_begun() >= session.snapshots_taken(k)) continue;
    if (tissue_[k].time_left() > kTissueNoise * dt) continue;
    tissue_[k].go_on();
    has_new_mesh |= tissue_[k].is_new_mesh();
  }
  return has_new_mesh;
}

void TickCheck::check_part(const SpanPart& part) {
  const std::int64_t before = findings.samples;
  std::fill(distance_.begin(), distance_.end(), kInfinity);
  for (std::size_t k = 0; k < tissue_.size(); ++k) {
    for (std::size_t body = 0; body < oracle_.part_count(); ++body) check_pair(k, body, part);
  }
  findings.near += findings.samples > before;
}

// A pair that starts nearer than what is kept comes no nearer, but for what ends a search; nothing
// is promised while it crosses.
void TickCheck::check_pair(std::size_t number, std::size_t body, const SpanPart& part) {
  const ToolObstacle& obstacle = obstacles_[number];
  const Scalar margin = obstacle.margin;
  // Regions that do not hold the tool may be crossed: only their distance at the end counts.
  const Scalar wanted = is_hard(obstacle) ? margin + kRounding : -kInfinity;
  const SpanDistance found =
      oracle_.check(body, part, tissue_[number], margin + kLook, wanted, kResolution);
  findings.samples += found.samples;
  distance_[number] = std::min(distance_[number], found.at_end);
  if (!is_hard(obstacle)) return;
  const Scalar start = found.at_start;
  start_.add(start, margin);
  if (start < margin - kRounding && !is_exempt() && tick_->status != HapticStatus::InvalidInput) {
    ++findings.breaches;
    tell("starts untold within the margin", number, start, margin);
  }
  if (!(start > kRounding)) return;
  const Scalar promised = promised_distance(start, margin, options_.rest_offset);
  if (has_full_promise(start, margin, options_.rest_offset)) {
    findings.least_excess = std::min(findings.least_excess, found.least - margin);
    const bool is_proven = found.proven > margin;
    findings.unproven += !is_proven;
    if (!is_proven) tell("is proven to stay at", number, found.proven, margin);
  }
  if (found.least >= promised - kRounding) return;
  ++findings.breaches;
  tell("comes to", number, found.least, promised);
}

void TickCheck::check_clearances() {
  for (std::size_t k = 0; k < tissue_.size(); ++k) {
    const Scalar margin = obstacles_[k].margin;
    const ToolClearance& clearance = tick_->clearances[k];
    if (!(distance_[k] < margin + kLook)) continue;
    const bool is_right = clearance.lower <= distance_[k] + kRounding &&
                          clearance.upper >= distance_[k] - kRounding &&
                          (!clearance.is_breached || distance_[k] < margin + kRounding);
    findings.wrong_clearances += !is_right;
    if (is_right) continue;
    tell("distance", k, distance_[k], margin);
    tell("is told to be between", k, clearance.lower, clearance.upper);
  }
}

// The tool goes on as in this tick, and the tissue on its line.
void TickCheck::check_time_to_breach(Scalar dt) {
  const ToolSpanPath further(tick_->tool, once_more(tick_->path.front().tool, tick_->tool));
  for (std::size_t k = 0; k < tissue_.size(); ++k) {
    const Scalar margin = obstacles_[k].margin;
    const Scalar time = std::min(
        {dt, tick_->clearances[k].time_to_breach * (1 - kTissueNoise), tissue_[k].time_left()});
    if (!(time > kTissueNoise * dt)) continue;
    for (std::size_t body = 0; body < oracle_.part_count(); ++body) {
      const SpanDistance found = oracle_.check(body, {further, 0, time / dt, time}, tissue_[k],
                                               margin + kResolution, margin, kResolution);
      if (found.least >= margin - kRounding) continue;
      ++findings.early_breaches;
      tell("is breached before its time, at", k, found.least, time);
    }
  }
}

// The session's own view of the tissue.
void TickCheck::check_tissue(const HapticSession& session) {
  for (std::size_t k = 0; k < tissue_.size(); ++k) {
    if (obstacles_[k].shape || !(number_ % kSeldom == 0 || tissue_[k].is_new_mesh())) continue;
    const std::vector<Vector3> places = session.tissue_vertices(k);
    Scalar off = places.size() == tissue_[k].vertex_count() ? 0 : kInfinity;
    for (std::size_t i = 0; i < places.size() && off < kInfinity; ++i) {
      off = std::max(off, (places[i] - tissue_[k].place(i)).norm());
    }
    findings.wrong_tissue += !(off <= kTissueNoise);
    if (!(off <= kTissueNoise)) tell("tissue is off by", k, off, kTissueNoise);
  }
}

// What a status says is true.
void TickCheck::check_status(const DevicePose& device, Scalar dt) {
  const HapticStatus status = tick_->status;
  const Scalar done = tick_->path.back().time;
  const Scalar small = 1e-3 * options_.rest_offset;
  bool is_true = true;
  if (status == HapticStatus::Free) {
    const Scalar off = (tick_->tool.X_WT.translation() - device.p_WD).norm() +
                       Eigen::Quaternion<Scalar>(tick_->tool.X_WT.rotation())
                           .angularDistance(device.q_WD.normalized());
    is_true = off < small;
  }
  if (status == HapticStatus::Free || status == HapticStatus::Held ||
      status == HapticStatus::Blocked) {
    is_true = is_true && std::abs(done - dt) <= 1e-6 * dt;
  }
  if (status == HapticStatus::Trapped) is_true = done < dt;
  if (status == HapticStatus::Deadline) is_true = tick_->cutoff.has_value();
  if (status == HapticStatus::Recovering) {
    is_true = start_.least_excess < kTolerance * options_.rest_offset + kRounding;
  }
  if (status == HapticStatus::Overlapping) {
    is_true = start_.least < small;
  }
  findings.wrong_statuses += !is_true;
  if (!is_true)
    tell("status is not true; excess and distance", 0, start_.least_excess, start_.least);
}

}  // namespace dyop::testing
