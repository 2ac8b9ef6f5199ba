// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/run_recording.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "core/tolerance.h"
#include "dyop/io/file_error.h"
#include "io/scene/small_run.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

std::string record_small_run() {
  std::ostringstream out;
  RunRecorder recorder(out, testing::small_scene());
  recorder.write(testing::small_report());
  recorder.finish();
  return out.str();
}

class RunRecordingFile : public ::testing::Test {
 protected:
  RunRecording read(const std::string& text) const {
    return read_recording(directory_.write("recording.jsonl", text));
  }
  testing::TemporaryDirectory directory_;
};

TEST_F(RunRecordingFile, HasOneJsonObjectPerLineInTheOrderOfTime) {
  std::istringstream lines(record_small_run());
  std::vector<std::string> records;
  for (std::string line; std::getline(lines, line);) {
    records.push_back(nlohmann::json::parse(line).at("record").get<std::string>());
  }
  EXPECT_EQ(records, (std::vector<std::string>{"header", "step", "impact", "step", "woke", "asleep",
                                               "end"}));
}

TEST_F(RunRecordingFile, HasTheSameBytesForTheSameRun) {
  EXPECT_EQ(record_small_run(), record_small_run());
}

TEST_F(RunRecordingFile, ReadsBackWhatWasWritten) {
  const RunRecording recording = read(record_small_run());
  EXPECT_EQ(recording.scene, testing::small_scene().source);
  ASSERT_EQ(recording.bodies.size(), 2u);
  EXPECT_EQ(recording.bodies[0].name, "mover");
  EXPECT_EQ(recording.bodies[1].kind, BodyKind::Static);
  EXPECT_TRUE(recording.is_complete);
  EXPECT_EQ(recording.totals.status, AdvanceStatus::Completed);
  EXPECT_EQ(recording.totals.t, 1);
  EXPECT_EQ(recording.totals.steps, 2);
  EXPECT_EQ(recording.totals.impacts, 1);
  ASSERT_EQ(recording.totals.too_near.size(), 1u);
  EXPECT_EQ(recording.totals.too_near[0], std::make_pair(BodyId(0), BodyId(1)));
  EXPECT_EQ(recording.totals.integrator.rejected_steps, 6);
  EXPECT_EQ(recording.totals.toi.node_pairs, 3);
  EXPECT_EQ(recording.totals.work.pairs_by_query, 8);
}

TEST_F(RunRecordingFile, TellsTheErrorThatEndedARun) {
  std::ostringstream out;
  RunRecorder recorder(out, testing::small_scene());
  recorder.write(testing::small_report());
  recorder.fail("the solver gave up");
  const RunRecording recording = read(out.str());
  EXPECT_TRUE(recording.is_complete);
  EXPECT_EQ(recording.totals.error, "the solver gave up");
  EXPECT_EQ(recording.totals.end(), "Error");
  EXPECT_EQ(recording.totals.t, 1);
}

TEST_F(RunRecordingFile, KeepsEveryNumberOfAnImpactExactly) {
  const ImpactEvent expected = testing::small_impact();
  const RunRecording recording = read(record_small_run());
  ASSERT_EQ(recording.impacts.size(), 1u);
  const ImpactEvent& event = recording.impacts[0];
  EXPECT_EQ(event.t, expected.t);
  EXPECT_EQ(event.b, BodyId(1));
  EXPECT_EQ(event.toi.status, ToiStatus::Impact);
  EXPECT_EQ(event.toi.t_hit, expected.toi.t_hit);
  EXPECT_EQ(event.toi.rounding_allowance, 1e-15);
  EXPECT_EQ(event.toi.statistics.peak_queue, 44);
  EXPECT_EQ(event.toi.X_WB.translation(), expected.toi.X_WB.translation());
  ASSERT_TRUE(event.toi.contact.has_value());
  EXPECT_EQ(event.toi.contact->p_WCa, expected.toi.contact->p_WCa);
  EXPECT_EQ(event.toi.contact->nhat_AB_W, expected.toi.contact->nhat_AB_W);
  EXPECT_EQ(event.toi.contact->feature_a, expected.toi.contact->feature_a);
  EXPECT_EQ(event.toi.contact->feature_b, expected.toi.contact->feature_b);
  EXPECT_EQ(event.toi.contact->triangle_a, 17);
  EXPECT_FALSE(event.toi.contact->triangle_b.has_value());
  ASSERT_EQ(event.contacts.size(), 1u);
  EXPECT_EQ(event.contacts[0].impulse_W, expected.contacts[0].impulse_W);
  EXPECT_EQ(event.contacts[0].contact.feature_b, expected.contacts[0].contact.feature_b);
  EXPECT_EQ(event.contacts[0].contact.upper, 0.16);
}

TEST_F(RunRecordingFile, RebuildsTheMotionWithinEveryStep) {
  const auto motion = testing::small_motion();
  const RunRecording recording = read(record_small_run());
  ASSERT_EQ(recording.steps.size(), 2u);
  EXPECT_EQ(recording.steps[0].times.back(), 1.0 / 3);
  EXPECT_EQ(recording.steps[1].times.front(), 1.0 / 3);
  for (const RecordedStep& step : recording.steps) {
    const Scalar begin = step.times.front();
    const Scalar length = step.times.back() - begin;
    for (const Scalar t : step.times) {
      const RigidPose X = recorded_pose(step, BodyId(0), t);
      EXPECT_EQ(X.translation(), motion->pose(t).translation());
      EXPECT_TRUE(X.rotation().isApprox(motion->pose(t).rotation(), kPoseNoise));
    }
    for (int k = 0; k <= 100; ++k) {
      const Scalar t = k == 100 ? step.times.back() : begin + length * k / 100;
      const RigidPose X = recorded_pose(step, BodyId(0), t);
      // The position is a cubic, so its pieces are the same cubic.
      EXPECT_TRUE(X.translation().isApprox(motion->pose(t).translation(), 1e-12));
      // The rotation is a cubic in another chart, so a piece of length h = 1/6 errs by h^4 / 384
      // times its fourth derivative, which is a few tens for these rates.
      EXPECT_LT((X.rotation() - motion->pose(t).rotation()).norm(), 1e-4);
      EXPECT_EQ(recorded_pose(step, BodyId(1), t).translation(), Vector3(9, 9, 9));
    }
  }
  EXPECT_THROW(recorded_pose(recording.steps[0], BodyId(0), 0.9), InvalidArgument);
  EXPECT_THROW(recorded_pose(recording.steps[0], BodyId(2), 0.1), InvalidArgument);
}

TEST_F(RunRecordingFile, TellsThatTheEndIsMissing) {
  const std::string whole = record_small_run();
  const std::string text = whole.substr(0, whole.rfind("{\"record\":\"end\""));
  EXPECT_FALSE(read(text).is_complete);
}

TEST_F(RunRecordingFile, NamesTheLineThatIsWrong) {
  const auto message_of = [&](const std::string& text) -> std::string {
    try {
      read(text);
    } catch (const FileError& error) {
      return std::string(error.what())
          .substr((directory_.path() / "recording.jsonl").string().size());
    }
    return "no error";
  };
  const std::string whole = record_small_run();
  EXPECT_EQ(message_of(""), ": the file is empty");
  EXPECT_EQ(message_of("{\"record\":\"step\"}\n"), ":1: expected the header");
  EXPECT_EQ(message_of(whole + "{\"record\":\"dance\"}\n"), ":8: unknown record dance");
  EXPECT_TRUE(message_of(whole.substr(0, whole.size() - 10)).starts_with(":7: "));
  EXPECT_TRUE(message_of(whole + "{\"record\":\"step\",\"t\":[1,0],\"states\":[]}\n")
                  .starts_with(":8: expected increasing times"));
}

}  // namespace
}  // namespace dyop
