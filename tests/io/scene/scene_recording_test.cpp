// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/scene_recording.h"

#include <gtest/gtest.h>

#include <sstream>

#include "dyop/io/file_error.h"
#include "dyop/io/recording_reader.h"
#include "dyop/io/run_recording.h"
#include "io/scene/small_run.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

class SceneRecording : public ::testing::Test {
 protected:
  std::filesystem::path text(bool is_complete = true) const {
    std::ostringstream out;
    RunRecorder recorder(out, testing::small_scene());
    recorder.write(testing::small_report());
    if (is_complete) recorder.finish();
    return directory_.write("recording.jsonl", out.str());
  }
  std::filesystem::path out() const { return directory_.path() / "run.h5"; }
  testing::TemporaryDirectory directory_;
};

TEST_F(SceneRecording, IsHeadedByItsScene) {
  Scene scene = testing::small_scene();
  scene.options.target_distance = 0.5;
  const RunHeader header = run_header(scene);
  EXPECT_EQ(header.title, "Small");
  EXPECT_EQ(header.scene, scene.source);
  EXPECT_EQ(header.target_distance, 0.5);
  EXPECT_EQ(header.end_time, 2);
  EXPECT_EQ(header.step, 1);
}

TEST_F(SceneRecording, ConvertsARecordingAsText) {
  const std::filesystem::path file = text();
  convert_recording(file, testing::small_scene(), out());
  const RunRecording expected = read_recording(file);
  const RecordingReader reader(out());
  EXPECT_EQ(reader.interval().end, 1);
  ASSERT_EQ(reader.bodies().size(), 2u);
  EXPECT_EQ(reader.bodies()[0].name, "mover");
  EXPECT_EQ(reader.segment(BodyId(0), 0).kind, SegmentKind::Approximate);
  EXPECT_EQ(reader.segment(BodyId(1), 0).kind, SegmentKind::Rest);
  EXPECT_EQ(reader.segment_count(BodyId(1)), 1u);
  ASSERT_EQ(reader.steps().size(), expected.steps.size());
  for (const RecordedStep& step : expected.steps) {
    for (int k = 0; k <= 100; ++k) {
      const Scalar length = step.times.back() - step.times.front();
      const Scalar t = k == 100 ? step.times.back() : step.times.front() + length * k / 100;
      for (const BodyId body : {BodyId(0), BodyId(1)}) {
        const RigidPose expected_pose = recorded_pose(step, body, t);
        const RigidPose pose = reader.pose(body, t);
        EXPECT_TRUE(pose.translation().isApprox(expected_pose.translation(), 1e-12));
        EXPECT_TRUE(pose.rotation().isApprox(expected_pose.rotation(), 1e-12));
      }
    }
  }
  ASSERT_EQ(reader.impacts().size(), 1u);
  EXPECT_EQ(reader.impacts()[0].toi.t_hit, expected.impacts[0].toi.t_hit);
  EXPECT_EQ(reader.impacts()[0].contacts[0].impulse_W, Vector3(0, 0, 1.0 / 9));
  ASSERT_TRUE(reader.end().has_value());
  EXPECT_EQ(reader.end()->status, AdvanceStatus::Completed);
}

TEST_F(SceneRecording, OfAKilledRunStaysWithoutAnEnd) {
  convert_recording(text(false), testing::small_scene(), out());
  EXPECT_FALSE(RecordingReader(out()).end().has_value());
}

TEST_F(SceneRecording, RefusesAnotherScene) {
  Scene scene = testing::small_scene();
  scene.bodies.pop_back();
  EXPECT_THROW(convert_recording(text(), scene, out()), FileError);
}

}  // namespace
}  // namespace dyop
