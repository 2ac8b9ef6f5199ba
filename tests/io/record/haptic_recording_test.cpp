// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/haptic_recording.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>

#include "dyop/core/error.h"
#include "dyop/geometry/primitives.h"
#include "dyop/io/file_error.h"
#include "dyop/io/recording.h"
#include "io/record/hdf5_file.h"
#include "io/record/recorded_world.h"
#include "io/record/recording_version.h"
#include "io/record/tick_row.h"
#include "support/inputs/haptic_runs.h"
#include "support/message_of.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

namespace fs = std::filesystem;
using testing::cut_triangles;
using testing::heaving_device;
using testing::heaving_scene;
using testing::kHeavingWork;
using testing::record_heaving_run;
using testing::record_two;
using testing::scene_of_two;

// The digests of the recorded inputs, run again.
void expect_same_bits(const HapticRecordingReader& reader) {
  HapticSession session(reader.scene(), reader.options());
  std::int64_t snapshots = 0;
  for (const RecordedTick& recorded : reader.ticks(0, reader.tick_count())) {
    if (recorded.new_snapshots[0] > 0) {
      const RecordedSnapshot given = reader.snapshot(0, ++snapshots);
      ASSERT_TRUE(given.is_mesh() ? session.give_mesh(0, given.vertices, given.triangles)
                                  : session.give_snapshot(0, given.vertices, given.duration));
    }
    std::vector<DevicePose> devices{recorded.device};
    for (const RecordedTool& other : recorded.others) devices.push_back(other.device);
    const auto ticks = session.replay(devices, recorded.dt, recorded.cutoff);
    ASSERT_EQ(tick_digest(ticks), recorded.digest) << recorded.number;
  }
}

TEST(HapticRecording, HoldsTheInputsOfARunWithEveryBit) {
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  const std::vector<HapticTick> run = record_heaving_run(file, 400);
  const HapticRecordingReader reader(file);
  ASSERT_EQ(reader.tick_count(), 400);
  EXPECT_TRUE(is_haptic_recording(file));
  EXPECT_EQ(reader.header().title, "heaving");
  EXPECT_EQ(reader.options().coupling.largest_force, kInfinity);
  EXPECT_EQ(reader.options().max_work, kHeavingWork);
  ASSERT_TRUE(reader.end().has_value());
  expect_same_bits(reader);
  EXPECT_FALSE(reader.snapshot(0, 1).is_mesh());
  const RecordedSnapshot mesh = reader.snapshot(0, 10);
  EXPECT_EQ(mesh.triangles, cut_triangles(reader.scene()));
  EXPECT_EQ(mesh.vertices.size(), reader.scene().obstacles[0].vertices.size() + 1);
  EXPECT_EQ(reader.snapshot(0, 11).vertices.size(), mesh.vertices.size());
  int cut_off = 0;
  for (const HapticTick& tick : run) cut_off += tick.cutoff.has_value();
  EXPECT_GT(cut_off, 40);
  EXPECT_GT(run.back().snapshots[0], 20);
}

TEST(HapticRecording, RoundsResultsToTheSafeSide) {
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  const std::vector<HapticTick> run = record_heaving_run(file, 200);
  const HapticRecordingReader reader(file);
  for (const RecordedTick& recorded : reader.ticks(0, 200)) {
    const HapticTick& tick = run[std::size_t(recorded.number)];
    EXPECT_EQ(recorded.status, tick.status);
    EXPECT_EQ(recorded.tool.X_WT.translation(), tick.tool.X_WT.translation());
    EXPECT_TRUE(recorded.tool.X_WT.rotation().isApprox(tick.tool.X_WT.rotation(), 1e-6));
    EXPECT_NEAR(recorded.tool.angles[0], tick.tool.angles[0], 1e-7);
    EXPECT_TRUE(recorded.wrench.force_W.isApprox(tick.wrench.force_W, 1e-6));
    ASSERT_EQ(recorded.clearances.size(), 2u);
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_LE(recorded.clearances[k].lower, tick.clearances[k].lower);
      EXPECT_GE(recorded.clearances[k].upper, tick.clearances[k].upper);
      EXPECT_NEAR(recorded.clearances[k].lower, tick.clearances[k].lower, 1e-5);
      EXPECT_LE(recorded.clearances[k].time_to_breach, tick.clearances[k].time_to_breach);
      EXPECT_EQ(recorded.clearances[k].is_breached, tick.clearances[k].is_breached);
    }
    ASSERT_TRUE(recorded.nearest.has_value());
    const ToolClearance& nearest = recorded.clearances[*recorded.nearest];
    EXPECT_LE(nearest.upper, recorded.clearances[1 - *recorded.nearest].upper);
    EXPECT_TRUE(nearest.p_WT.isApprox(tick.clearances[*recorded.nearest].p_WT, 1e-5));
  }
}

TEST(HapticRecording, ADigestTellsAnyBit) {
  HapticTick tick;
  tick.clearances.resize(2);
  tick.contacts.resize(1);
  const std::uint64_t digest = tick_digest(tick);
  HapticTick other = tick;
  other.latency = std::chrono::nanoseconds(5);
  other.statistics.node_pairs = 5;
  EXPECT_EQ(tick_digest(other), digest);
  other.contacts[0].force_W.y() = -0.0;
  EXPECT_NE(tick_digest(other), digest);
  other = tick;
  other.clearances[1].lower = std::nextafter(0.0, 1.0);
  EXPECT_NE(tick_digest(other), digest);
  std::swap(other.clearances[0], other.clearances[1]);
  EXPECT_NE(tick_digest(other), digest);
}

TEST(HapticRecording, HoldsAllToolsOfASession) {
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  const auto run = record_two(file, 300);
  const HapticRecordingReader reader(file);
  ASSERT_EQ(reader.tick_count(), 300);
  expect_same_bits(reader);
  EXPECT_EQ(reader.bytes_per_tick(), 212u + 12 + 2 * 13 + 125 + 12 + 2 * 8 + 32);
  int met = 0;
  for (const RecordedTick& recorded : reader.ticks(0, 300)) {
    const HapticTick& tick = run[std::size_t(recorded.number)][1];
    ASSERT_EQ(recorded.others.size(), 1u);
    const RecordedTool& other = recorded.others[0];
    EXPECT_EQ(other.status, tick.status);
    EXPECT_EQ(other.tool.X_WT.translation(), tick.tool.X_WT.translation());
    EXPECT_TRUE(other.tool.X_WT.rotation().isApprox(tick.tool.X_WT.rotation(), 1e-6));
    EXPECT_NEAR(other.tool.angles[0], tick.tool.angles[0], 1e-6);
    EXPECT_EQ(other.device.angles[0], heaving_device(int(recorded.number)).angles[0]);
    EXPECT_TRUE(other.wrench.force_W.isApprox(tick.wrench.force_W, 1e-6));
    ASSERT_EQ(other.clearances.size(), 2u);
    EXPECT_LE(other.clearances[1].lower, tick.clearances[1].lower);
    EXPECT_NEAR(other.clearances[1].upper, tick.clearances[1].upper, 1e-5);
    ASSERT_EQ(recorded.tool_clearances.size(), 1u);
    EXPECT_LE(recorded.tool_clearances[0].lower, tick.tool_clearances[0].lower);
    EXPECT_GE(recorded.tool_clearances[0].upper, tick.tool_clearances[0].upper);
    EXPECT_NEAR(recorded.tool_clearances[0].lower, tick.tool_clearances[0].lower, 1e-5);
    EXPECT_TRUE(recorded.tool_clearances[0].p_WT.isApprox(tick.tool_clearances[0].p_WT, 1e-5));
    EXPECT_TRUE(recorded.tool_clearances[0].p_WO.isApprox(tick.tool_clearances[0].p_WO, 1e-5));
    met += !tick.tool_contacts.empty();
  }
  EXPECT_GT(met, 50);
}

TEST(HapticRecording, RefusesMoreThanATickHoldsAndFilesWithMoreHingesThanATool) {
  const testing::TemporaryDirectory directory;
  HapticScene scene = scene_of_two();
  HapticRecordingWriter writer(directory.path() / "run.h5", {}, scene, testing::haptic_options());
  TickRecord record;
  record.tick.clearances.resize(2);
  record.tick.snapshots.resize(2);
  EXPECT_THROW(writer.add(record), InvalidArgument);
  scene.more_tools[0].hinges.resize(kMostHinges + 1, scene.hinges[0]);
  const auto text = io_internal::session_text(scene, testing::haptic_options(), {});
  const std::vector<std::shared_ptr<const Shape>> shapes(9, scene.tool[0].shape);
  EXPECT_THROW(io_internal::session_from(io_internal::Json::parse(text.json), shapes),
               InvalidArgument);
}

// One hinge, two obstacles.
TEST(HapticRecording, TakesAsManyBytesATickAsStated) {
  const testing::TemporaryDirectory directory;
  const fs::path small = directory.path() / "small.h5", large = directory.path() / "large.h5";
  const HapticScene scene = heaving_scene();
  for (const bool is_large : {false, true}) {
    HapticRecordingWriter writer(is_large ? large : small, {}, scene, testing::haptic_options());
    TickRecord record;
    record.tick.clearances.resize(2);
    record.tick.snapshots.resize(2);
    for (int k = 0; k < (is_large ? 20'480 : 1'024); ++k) {
      record.number = k;
      writer.add(record);
    }
    EXPECT_EQ(writer.bytes_per_tick(), 212u + 12 + 2 * 13);
    writer.finish({});
  }
  const auto bytes = Scalar(fs::file_size(large) - fs::file_size(small)) / (20'480 - 1'024);
  EXPECT_LE(bytes, 1.01 * (212 + 12 + 2 * 13));
}

// Before version 3 the time for which tissue was stopped was a sum under another name.
TEST(HapticRecording, TellsForHowLongTissueWasStoppedInATick) {
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  const std::vector<Scalar> lags{0, 0.5, 0.5, 2}, stops{0.25, 0, 1, 0}, times{0, 1, 1.5, 8};
  {
    HapticRecordingWriter writer(file, {}, heaving_scene(), testing::haptic_options());
    TickRecord record;
    record.tick.clearances.resize(2);
    record.tick.snapshots.resize(2);
    for (std::size_t k = 0; k < lags.size(); ++k) {
      record.number = std::int64_t(k);
      record.tick.tissue_lag = lags[k];
      record.tick.tissue_stopped = stops[k];
      record.tick.tissue_behind = times[k];
      writer.add(record);
    }
    writer.finish({});
  }
  const auto expect = [&](std::int64_t first, const std::vector<Scalar>& stopped,
                          const std::vector<Scalar>& lag, const std::vector<Scalar>& behind) {
    const HapticRecordingReader reader(file);
    const auto ticks = reader.ticks(first, std::int64_t(stopped.size()));
    for (std::size_t k = 0; k < stopped.size(); ++k) {
      EXPECT_EQ(ticks[k].tissue_stopped, stopped[k]) << k;
      EXPECT_EQ(ticks[k].tissue_lag, lag[k]) << k;
      EXPECT_EQ(ticks[k].tissue_behind, behind[k]) << k;
    }
  };
  expect(0, stops, lags, times);
  testing::set_version(file, 6);
  expect(0, stops, lags, {0, 0, 0, 0});
  testing::set_version(file, 2);
  expect(0, {0, 0.5, 0, 1.5}, {0, 0, 0, 0}, {0, 0, 0, 0});
  expect(2, {0, 1.5}, {0, 0}, {0, 0});
}

// As after a kill: nothing of the process runs after the last tick.
TEST(HapticRecording, IsWholeUpToTheLastFlush) {
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  const pid_t child = fork();
  if (child == 0) {
    const HapticScene scene = heaving_scene();
    HapticSession session(scene, testing::haptic_options());
    HapticRecordingWriter writer(file, {"killed", "", 1e-3, ""}, scene, testing::haptic_options());
    for (int k = 0; k < 250; ++k) {
      TickRecord record{k, heaving_device(k), 1e-3, {}};
      record.tick = session.update(record.device, record.dt);
      writer.add(record);
    }
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_EQ(status, 0);
  const HapticRecordingReader reader(file);
  EXPECT_EQ(reader.tick_count(), 200);
  EXPECT_FALSE(reader.end().has_value());
  expect_same_bits(reader);
}

TEST(HapticRecording, AnErrorEndsItToo) {
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  HapticRecordingWriter writer(file, {}, heaving_scene(), testing::haptic_options());
  writer.fail("the device is gone");
  const HapticRecordingReader reader(file);
  ASSERT_TRUE(reader.end().has_value());
  EXPECT_EQ(reader.end()->error, "the device is gone");
  EXPECT_THROW(static_cast<void>(reader.ticks(0, 1)), InvalidArgument);
  EXPECT_THROW(static_cast<void>(reader.snapshot(0, 1)), InvalidArgument);
}

TEST(HapticRecording, RefusesWhatItCannotReplay) {
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  const HapticScene scene = heaving_scene();
  HapticRecordingWriter writer(file, {}, scene, testing::haptic_options());
  EXPECT_THROW(writer.add_snapshot(1, scene.obstacles[0].vertices, 1), InvalidArgument);
  EXPECT_THROW(writer.add_snapshot(0, std::span(scene.obstacles[0].vertices).first(2), 1),
               InvalidArgument);
  EXPECT_THROW(writer.add_mesh(1, {}, scene.obstacles[0].triangles), InvalidArgument);
  EXPECT_THROW(writer.add_mesh(0, scene.obstacles[0].vertices, {}), InvalidArgument);
  TickRecord record;
  record.tick.clearances.resize(2);
  record.tick.snapshots = {1, 0};
  EXPECT_NE(testing::message_of([&] { writer.add(record); }).find("snapshot 1 of obstacle 0"),
            std::string::npos);
}

TEST(HapticRecording, OfAnObservedSessionTakesNothingByHandNorARetargetOfAFormula) {
  const testing::TemporaryDirectory directory;
  HapticSession session(heaving_scene(), testing::haptic_options());
  TissueFeed feed;
  feed.formula = R"({"frequency": 1})";
  HapticRecordingWriter writer(directory.path() / "run.h5", {}, session, std::array{feed});
  const std::vector<Vector3> vertices = session.scene().obstacles[0].vertices;
  EXPECT_THROW(writer.add_snapshot(0, vertices, 0.01), InvalidArgument);
  EXPECT_THROW(HapticRecordingWriter(directory.path() / "two.h5", {}, session), InvalidArgument);
  EXPECT_FALSE(fs::exists(directory.path() / "two.h5"));
  session.give_snapshot(0, vertices, 0.01);
  TickRecord record{0, heaving_device(0), 1e-3, {}};
  record.tick = session.update(record.device, record.dt);
  writer.add(record);
  EXPECT_TRUE(session.retarget(0, vertices, 0.01));
  record.number = 1;
  record.tick = session.update(record.device, record.dt);
  EXPECT_NE(testing::message_of([&] { writer.add(record); }).find("follows a formula"),
            std::string::npos);
}

// It had no meshes.
TEST(HapticRecording, OfTheFirstVersionIsRead) {
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  record_heaving_run(file, 100);
  testing::set_version(file, 1);
  {
    const io_internal::Hdf5Handle opened(H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT),
                                         &H5Fclose);
    for (const char* name : {"meshes", "snapshot_triangles"}) {
      ASSERT_GE(H5Ldelete(opened.get(), name, H5P_DEFAULT), 0);
    }
  }
  const HapticRecordingReader reader(file);
  EXPECT_GT(reader.tick_count(), 0);
  expect_same_bits(reader);
}

TEST(HapticRecording, OtherVersionsAreRefused) {
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  record_heaving_run(file, 3);
  testing::set_version(file, 99);
  const std::string message = testing::message_of<FileError>([&] { HapticRecordingReader{file}; });
  EXPECT_NE(message.find("version 99"), std::string::npos) << message;
}

TEST(HapticRecording, TheTwoKindsOfRecordingsAreToldApart) {
  const testing::TemporaryDirectory directory;
  const fs::path tool = directory.path() / "tool.h5", world = directory.path() / "world.h5";
  record_heaving_run(tool, 3);
  testing::record_busy_run(world);
  EXPECT_FALSE(is_haptic_recording(world));
  EXPECT_NE(
      testing::message_of<FileError>([&] { RecordingReader{tool}; }).find("dyop tool recording"),
      std::string::npos);
  EXPECT_NE(testing::message_of<FileError>([&] {
              HapticRecordingReader{world};
            }).find("no recording of a tool"),
            std::string::npos);
  EXPECT_THROW(HapticRecordingReader(directory.path() / "none.h5"), FileError);
}

}  // namespace
}  // namespace dyop
