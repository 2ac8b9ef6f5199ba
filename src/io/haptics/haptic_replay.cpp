// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/haptic_replay.h"

#include "dyop/core/error.h"
#include "dyop/io/file_error.h"
#include "dyop/io/haptic_scene_file.h"

namespace dyop {
RecordedTissue::RecordedTissue(const HapticRecordingReader& reader,
                               const std::filesystem::path& file)
    : reader_(reader), sources_(reader.sources().size()) {
  for (std::size_t k = 0; k < sources_.size(); ++k) {
    const SnapshotSource& recorded = reader.sources()[k];
    if (recorded.formula.empty()) continue;
    const std::vector<Vector3>& vertices = reader.scene().obstacles[k].vertices;
    sources_[k].feed = feed_of_formula(file, recorded.formula, k, reader.scene());
    sources_[k].last = {vertices, recorded.period};
  }
}

const RecordedSnapshot& RecordedTissue::next(std::size_t obstacle) {
  Source& source = sources_.at(obstacle);
  ++source.number;
  if (!source.feed) {
    source.last = reader_.snapshot(obstacle, source.number);
    return source.last;
  }
  const TissueFeed& feed = *source.feed;
  if (auto mesh = feed.cut ? feed.cut(source.number) : std::nullopt) {
    source.last = {std::move(mesh->vertices), 0, std::move(mesh->triangles)};
  } else {
    feed.shape(source.number, source.last.vertices);
    source.last.duration = feed.period;
    source.last.triangles.clear();
  }
  return source.last;
}

// Of a snapshot that was taken back the number comes again: the file has what came in its place.
TissueStep RecordedTissue::step_of(const RecordedTick& tick, std::size_t obstacle) {
  TissueStep step{obstacle};
  for (const RecordedInput& input : tick.inputs) {
    const auto* turn = std::get_if<RecordedTurn>(&input);
    if (turn && turn->obstacle == obstacle) step.turn = *turn;
  }
  for (int n = tick.new_snapshots[obstacle]; n > 0; --n) step.next = &next(obstacle);
  if (!step.turn || !step.turn->is_given) return step;
  const Source& source = sources_.at(obstacle);
  DYOP_REQUIRE(step.turn->snapshot == source.number, "tick ", tick.number, " finds snapshot ",
               step.turn->snapshot, " of obstacle ", obstacle, ", after ", source.number);
  step.next = &source.last;
  return step;
}

namespace {

void give(const TissueStep& step, HapticSession& session) {
  if (step.turn) session.replay_turn(step.obstacle, step.turn->from);
  if (!step.next) return;
  const auto& [vertices, duration, triangles] = *step.next;
  if (step.next->is_mesh()) {
    session.give_mesh(step.obstacle, vertices, triangles);
  } else {
    session.give_snapshot(step.obstacle, vertices, duration);
  }
}

struct Setter {
  HapticSession& session;

  void operator()(const RecordedCoupling& input) const {
    session.set_coupling(input.coupling, input.tool);
  }
  void operator()(const RecordedReset& input) const { session.reset(input.pose, input.tool); }
  void operator()(const RecordedTurn& /*input*/) const {}  // RecordedTissue tells of it
};

void give_inputs(const RecordedTick& tick, const std::filesystem::path& file,
                 RecordedTissue& tissue, HapticSession& session) {
  try {
    for (const RecordedInput& input : tick.inputs) std::visit(Setter{session}, input);
    tissue.for_each_step(tick, [&](const TissueStep& step) { give(step, session); });
  } catch (const InvalidArgument& error) {
    throw FileError(file, error.what());
  }
}

}  // namespace

HapticReplay replay_haptic_recording(
    const std::filesystem::path& file,
    const std::function<void(const RecordedTick& recorded, const HapticTick& tick)>& on_tick) {
  const HapticRecordingReader reader(file);
  HapticSession session(reader.scene(), reader.options());
  RecordedTissue tissue(reader, file);
  HapticReplay replay;
  replay.recorded_by = reader.header().version;
  reader.for_each_tick([&](const RecordedTick& recorded) {
    if (recorded.number != replay.ticks) {
      throw FileError(file, core_internal::compose_message("lacks tick ", replay.ticks,
                                                           ": the log was too slow for the run"));
    }
    give_inputs(recorded, file, tissue, session);
    std::vector<DevicePose> devices{recorded.device};
    for (const RecordedTool& other : recorded.others) devices.push_back(other.device);
    const auto ticks = session.replay(devices, recorded.dt, recorded.cutoff);
    ++replay.ticks;
    if (on_tick) on_tick(recorded, ticks.front());
    if (tick_digest(ticks) == recorded.digest) return;
    ++replay.differing;
    if (!replay.first_difference) replay.first_difference = recorded.number;
  });
  return replay;
}

}  // namespace dyop
