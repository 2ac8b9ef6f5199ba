// SPDX-License-Identifier: BSD-3-Clause
#include "io/record/haptic_inputs.h"

#include <cmath>
#include <exception>

#include "dyop/core/error.h"
#include "io/record/tick_row.h"

namespace dyop::io_internal {
namespace {

struct InputToJson {
  Json& json;

  void operator()(const RecordedCoupling& input) const {
    json["tool"] = input.tool;
    json["coupling"] = springs_json(input.coupling);
  }
  void operator()(const RecordedReset& input) const {
    json["tool"] = input.tool;
    json["reset"] = {{"X_WT", pose_numbers(input.pose.X_WT)}, {"angles", input.pose.angles}};
  }
  void operator()(const RecordedTurn& input) const {
    json["obstacle"] = input.obstacle;
    json["snapshot"] = input.snapshot;
    json["from"] = input.from;
    json["is_given"] = input.is_given;
  }
};

RecordedTurn turn_from(const Json& json, const HapticScene& scene) {
  const RecordedTurn turn{json.at("obstacle").get<std::size_t>(),
                          json.at("snapshot").get<std::int64_t>(), json.at("from").get<Scalar>(),
                          json.at("is_given").get<bool>()};
  DYOP_REQUIRE(turn.obstacle < scene.obstacles.size() && deforms(scene.obstacles[turn.obstacle]),
               "an input is of obstacle ", turn.obstacle, ", which does not deform");
  DYOP_REQUIRE(turn.from >= 0 && turn.from <= 1, "a snapshot sets out from ", turn.from);
  return turn;
}

ToolPose tool_pose_from(const Json& json) {
  ToolPose pose{pose_from_numbers(json.at("X_WT")), {}};
  pose.angles = json.at("angles").get<std::array<Scalar, kMostHinges>>();
  return pose;
}

}  // namespace

HapticSession& recordable(HapticSession& session) {
  DYOP_REQUIRE(session.is_fresh(), "HapticSession: ",
               "it can be recorded from its start only, before ticks and inputs");
  DYOP_REQUIRE(!session.observer(), "HapticSession: ", "it is recorded or observed already");
  return session;
}

Json input_json(const TimedInput& input) {
  Json json{{"tick", input.first}};
  std::visit(InputToJson{json}, input.second);
  return json;
}

TimedInput input_from(const Json& json, const HapticScene& scene) {
  const auto tick = json.at("tick").get<std::int64_t>();
  if (json.contains("obstacle")) return {tick, turn_from(json, scene)};
  const auto tool = json.at("tool").get<std::size_t>();
  DYOP_REQUIRE(tool <= scene.more_tools.size(), "an input is of tool ", tool, ", which is missing");
  if (json.contains("coupling")) {
    return {tick, RecordedCoupling{tool, springs_from(json.at("coupling"))}};
  }
  return {tick, RecordedReset{tool, tool_pose_from(json.at("reset"))}};
}

void InputQueue::add(std::size_t obstacle, WaitingSnapshot snapshot) {
  const std::lock_guard lock(mutex_);
  std::deque<WaitingSnapshot>& waiting = waiting_[obstacle];
  if (!waiting.empty() && waiting.back().number == snapshot.number) waiting.pop_back();
  waiting.push_back(std::move(snapshot));
}

std::deque<WaitingSnapshot> InputQueue::take_snapshots(std::size_t obstacle, std::int64_t number) {
  const std::lock_guard lock(mutex_);
  std::deque<WaitingSnapshot> taken;
  std::deque<WaitingSnapshot>& waiting = waiting_[obstacle];
  while (!waiting.empty() && waiting.front().number <= number) {
    taken.push_back(std::move(waiting.front()));
    waiting.pop_front();
  }
  return taken;
}

std::vector<TimedInput> InputQueue::take_settings(std::int64_t tick) {
  const std::lock_guard lock(mutex_);
  std::vector<TimedInput> taken;
  while (!settings_.empty() && settings_.front().first <= tick) {
    taken.push_back(std::move(settings_.front()));
    settings_.pop_front();
  }
  return taken;
}

void InputQueue::require_complete() {
  if (!has_failed_) return;
  const std::lock_guard lock(mutex_);
  throw InvalidArgument(failure_);
}

void InputQueue::close() {
  is_closed_ = true;
  const std::lock_guard lock(mutex_);
  for (auto& waiting : waiting_) waiting.clear();
  settings_.clear();
}

// Observers must not throw: the writer does, when it comes to the next tick.
template <typename Keep>
void InputQueue::keep(const Keep& keep) noexcept {
  if (is_closed_ || has_failed_) return;
  try {
    keep();
  } catch (const std::exception& error) {
    const std::lock_guard lock(mutex_);
    failure_ = error.what();
    has_failed_ = true;
  }
}

void InputQueue::on_tissue(const TissueInput& input) noexcept {
  keep([&] {
    if (!is_stored(input.obstacle)) {
      DYOP_REQUIRE(!input.is_retarget, "obstacle ", input.obstacle,
                   " follows a formula: a recording cannot hold that it was retargeted");
      return;
    }
    add(input.obstacle, {input.snapshot,
                         {{input.vertices.begin(), input.vertices.end()},
                          input.duration,
                          {input.triangles.begin(), input.triangles.end()}}});
  });
}

void InputQueue::on_coupling(std::size_t tool, const CouplingOptions& coupling) noexcept {
  keep([&] {
    const std::lock_guard lock(mutex_);
    settings_.emplace_back(ticks_, RecordedCoupling{tool, coupling});
  });
}

void InputQueue::on_reset(std::size_t tool, const ToolPose& pose) noexcept {
  keep([&] {
    const std::lock_guard lock(mutex_);
    settings_.emplace_back(ticks_, RecordedReset{tool, pose});
  });
}

void InputQueue::on_tick(std::span<const DevicePose> /*devices*/, Scalar /*dt*/,
                         std::span<const HapticTick> /*ticks*/) noexcept {
  ++ticks_;
}

std::vector<TimedInput> TurnFinder::turns(const TickRecord& record,
                                          std::span<const std::uint8_t> new_snapshots) {
  std::vector<TimedInput> turns;
  const HapticTick& tick = record.tick;
  for (std::size_t k = 0; k < tick.inputs.size(); ++k) {
    const ObstacleInput& found = tick.inputs[k];
    ObstacleInput& left = left_[k];
    const bool is_next = found.given > left.given && left.given == 0 && new_snapshots[k] > 0;
    const bool is_as_left = found.end == left.end && (found.given == left.given || is_next);
    if (!is_as_left) {
      turns.emplace_back(record.number,
                         RecordedTurn{k, found.snapshot + 1, found.end, found.given > 0});
    }
    const bool has_started = tick.progress[k].snapshot > found.snapshot;
    left = has_started ? ObstacleInput{} : found;
  }
  return turns;
}

}  // namespace dyop::io_internal
