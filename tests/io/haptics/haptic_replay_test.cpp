// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/haptic_replay.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include "dyop/io/file_error.h"
#include "dyop/io/haptic_recording.h"
#include "dyop/io/haptic_scene_file.h"
#include "support/damaged_files.h"
#include "support/inputs/haptic_run_texts.h"
#include "support/message_of.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

namespace fs = std::filesystem;

struct ReplayCase {
  bool is_paced = false;
  std::int64_t ticks = 600;
  Scalar rate = 1000;
  bool is_cut = false;
  bool has_formula = true;
};

// Runs the small scene and records it; the deadline cuts many ticks off.
void record_small_run(const fs::path& file, const ReplayCase& how,
                      const std::function<void(TickRecord&)>& change = {}) {
  HapticRun run = parse_haptic_run(
      "scene.json", how.is_cut ? testing::cut_haptic_scene() : testing::kSmallHapticScene);
  if (!how.has_formula) run.tissue[0].formula.clear();
  run.runner.ticks = how.ticks;
  run.runner.is_paced = how.is_paced;
  run.runner.period = 1 / how.rate;
  run.runner.deadline = std::chrono::microseconds(40);
  HapticSession session(run.scene, run.options);
  HapticRecordingWriter writer(file, {run.title, run.text, run.runner.period, ""}, session,
                               run.tissue);
  const RunnerReport report = run_session(
      session, [&](std::int64_t tick) { return run.device(tick); }, run.tissue,
      [&](const TickRecord& record) {
        TickRecord changed = record;
        if (change) change(changed);
        writer.add(changed);
      },
      run.runner);
  writer.finish(report);
}

TEST(HapticReplay, GivesTheSameBitsFromTheInputsAlone) {
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  for (const ReplayCase& how : {ReplayCase{}, ReplayCase{true}, ReplayCase{true, 600, 5000}}) {
    record_small_run(file, how);
    int cut_off = 0;
    const HapticReplay replay =
        replay_haptic_recording(file, [&](const RecordedTick& recorded, const HapticTick& tick) {
          cut_off += recorded.cutoff.has_value();
          EXPECT_EQ(recorded.status, tick.status);
        });
    EXPECT_EQ(replay.ticks, 600);
    EXPECT_EQ(replay.differing, 0) << "first " << replay.first_difference.value_or(-1);
    EXPECT_GT(cut_off, 0);
  }
}

// The liver goes on as another mesh, from the formula and from the file.
TEST(HapticReplay, HandsMeshesOverAgain) {
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  for (const bool has_formula : {true, false}) {
    record_small_run(file, {false, 600, 1000, true, has_formula});
    const HapticReplay replay = replay_haptic_recording(file);
    EXPECT_EQ(replay.ticks, 600);
    EXPECT_EQ(replay.differing, 0) << "first " << replay.first_difference.value_or(-1);
    const HapticRecordingReader reader(file);
    RecordedTissue tissue(reader, file);
    for (int number = 1; number <= 8; ++number) {
      EXPECT_EQ(tissue.next(0).is_mesh(), number == 5) << number;
    }
  }
}

// What a model answered is part of the file: the replay needs no model.
TEST(HapticReplay, GivesBackWhatTissueAnswered) {
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  HapticRun run = parse_haptic_run("scene.json", testing::elastic_haptic_scene());
  run.runner.ticks = 400;
  run.runner.is_paced = false;
  HapticSession session(run.scene, run.options);
  HapticRecordingWriter writer(file, {run.title, run.text, run.runner.period, ""}, session,
                               run.tissue);
  Scalar largest_force = 0;
  writer.finish(run_session(
      session, [&](std::int64_t tick) { return run.device(tick); }, run.tissue,
      [&](const TickRecord& record) {
        largest_force = std::max(largest_force, record.tick.wrench.force_W.norm());
        writer.add(record);
      },
      run.runner));
  EXPECT_GT(largest_force, 0.1);
  const HapticReplay replay = replay_haptic_recording(file);
  EXPECT_EQ(replay.ticks, 400);
  EXPECT_EQ(replay.differing, 0) << "first " << replay.first_difference.value_or(-1);
}

// The scene's formula is part of the file, and stands for the snapshots.
TEST(HapticReplay, NeedsNoVerticesOfTissueThatBreathesByAFormula) {
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  record_small_run(file, {});
  const HapticReplay replay = replay_haptic_recording(file);
  EXPECT_EQ(replay.differing, 0);
  const HapticRecordingReader reader(file);
  EXPECT_FALSE(reader.sources()[0].formula.empty());
  EXPECT_TRUE(reader.sources()[1].formula.empty());
  RecordedTissue tissue(reader, file);
  EXPECT_EQ(tissue.next(0).duration, 0.02);
  EXPECT_THROW(tissue.next(1), InvalidArgument);
}

TEST(HapticReplay, NamesTheFirstDifference) {
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  record_small_run(file, {false, 30}, [](TickRecord& record) {
    if (record.number == 17) record.tick.wrench.force_W.x() += 1e-9;
  });
  const HapticReplay replay = replay_haptic_recording(file);
  EXPECT_EQ(replay.differing, 1);
  EXPECT_EQ(replay.first_difference, 17);
}

TEST(HapticReplay, RefusesARunWithMissingTicks) {
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  record_small_run(file, {false, 30}, [](TickRecord& record) {
    if (record.number >= 12) ++record.number;
  });
  const std::string message =
      testing::message_of<FileError>([&] { replay_haptic_recording(file); });
  EXPECT_NE(message.find("lacks tick 12"), std::string::npos) << message;
}

TEST(HapticReplay, ADamagedFileIsAnError) {
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  record_small_run(file, {false, 3000});
  fs::resize_file(file, fs::file_size(file) / 2);
  EXPECT_THROW(replay_haptic_recording(file), FileError);
  std::ofstream(file) << "something else";
  EXPECT_THROW(replay_haptic_recording(file), FileError);
}

// All that a reader tells of a recording, snapshots and meshes included.
std::uint64_t haptic_content_of(const fs::path& file) {
  const HapticRecordingReader reader(file);
  RecordedTissue tissue(reader, file);
  std::ostringstream text;
  text << std::hexfloat << reader.header().title << reader.sources()[0].formula;
  reader.for_each_tick([&](const RecordedTick& tick) {
    text << tick.number << ' ' << tick.dt << ' ' << tick.cutoff.has_value() << int(tick.status)
         << tick.nearest.value_or(9) << tick.energy_returned << tick.tissue_stopped
         << tick.wrench.force_W.transpose() << tick.device.p_WD.transpose()
         << tick.device.q_WD.coeffs().transpose() << ' ' << tick.latency.count() << ' '
         << tick.digest;
    for (std::size_t k = 0; k < tick.new_snapshots.size(); ++k) {
      for (int n = tick.new_snapshots[k]; n > 0; --n) {
        const RecordedSnapshot& snapshot = tissue.next(k);
        text << snapshot.duration;
        for (const Vector3& vertex : snapshot.vertices) text << vertex.transpose();
        for (const TriangleIndices& t : snapshot.triangles) text << t[0] << t[1] << t[2] << ' ';
      }
    }
  });
  return std::hash<std::string>()(text.str());
}

TEST(HapticReplay, DamageOfOneBitIsAnErrorOrChangesNothing) {
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  record_small_run(file, {false, 200, 1000, true, false});
  EXPECT_GT(testing::flip_bits(
                file, [&] { return haptic_content_of(file); }, 60),
            5);
}

}  // namespace
}  // namespace dyop
