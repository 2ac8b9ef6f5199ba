// SPDX-License-Identifier: BSD-3-Clause

// Runs of small generated scenes, checked as any recording is; and that the check sees what is
// wrong.

#include "support/oracles/recording_oracle.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/temporary_directory.h"

namespace dyop::testing {
namespace {

using testing::TemporaryDirectory;

std::string obj_text(const testing::MeshArrays& mesh) {
  std::ostringstream out;
  out.precision(9);
  for (const Vector3& p : mesh.vertices) {
    out << "v " << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
  }
  for (const TriangleIndices& t : mesh.triangles) {
    out << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
  }
  return out.str();
}

std::string vector_text(const Vector3& v) {
  std::ostringstream out;
  out << '[' << v.x() << ',' << v.y() << ',' << v.z() << ']';
  return out.str();
}

// Bodies of every kind in a column, all turning, that fall on each other and on a floor.
class FallingBodies : public ::testing::Test {
 protected:
  FallingBodies() {
    directory_.write("gear.obj", obj_text(testing::gear(6, 0.3, 0.5, 0.2)));
    directory_.write("ring.obj", obj_text(testing::torus(0.4, 0.12, 16, 8)));
    std::mt19937_64 random(7);
    std::string bodies;
    int place = 0;
    for (const char* shape :
         {R"({"mesh":"gear.obj"})", R"({"mesh":"ring.obj"})",
          R"({"box":{"half_extents":[0.3,0.2,0.1]}})",
          R"({"capsule":{"radius":0.1,"half_length":0.4}})", R"({"sphere":{"radius":0.25}})",
          R"({"hull":{"mesh":"gear.obj","scale":0.7}})", R"({"mesh":"ring.obj","scale":0.8})"}) {
      ++place;
      const Vector3 position = Vector3(0, 0, 1.1 * place) + random_vector(0.1, random);
      bodies += R"({"name":"body )" + std::to_string(place) + R"(","density":1,"shape":)" + shape +
                R"(,"pose":{"position":)" + vector_text(position) +
                R"(},"velocity":{"linear":[0,0,-2],"angular":)" +
                vector_text(random_vector(6, random)) + "}},";
    }
    scene_file_ = directory_.write(
        "scene.json",
        R"({"time":{"end":0.7,"step":0.05},"bodies":[)" + bodies +
            R"({"name":"floor","kind":"static","shape":{"box":{"half_extents":[5,5,1]}},
            "pose":{"position":[0,0,-1]}}],"forces":{"gravity":[0,0,-9.81]}})");
    scene_ = load_scene(scene_file_);
  }

  RunRecording run() {
    const std::filesystem::path file = directory_.path() / "recording.jsonl";
    std::ofstream out(file, std::ios::binary);
    RunRecorder recorder(out, scene_);
    World world = make_world(scene_);
    for (int k = 0; k < 14; ++k) {
      const AdvanceReport report = world.advance(scene_.step);
      EXPECT_EQ(report.status, AdvanceStatus::Completed);
      recorder.write(report);
    }
    recorder.finish();
    out.close();
    return read_recording(file);
  }

  bool has_fault(const RunRecording& recording, const std::string& part) const {
    const RecordingReport report = check_recording(scene_, recording, 0);
    return std::any_of(report.faults.begin(), report.faults.end(), [&](const std::string& fault) {
      return fault.find(part) != std::string::npos;
    });
  }

  TemporaryDirectory directory_;
  std::filesystem::path scene_file_;
  Scene scene_;
};

TEST_F(FallingBodies, NeverIntersect) {
  const RunRecording recording = run();
  EXPECT_GE(recording.totals.impacts, 10);
  const RecordingReport report = check_recording(scene_, recording, 4);
  EXPECT_GT(report.examined_pairs, 1000);
  for (const std::string& fault : report.faults) ADD_FAILURE() << fault;
}

TEST_F(FallingBodies, AreCaughtWhereTheyAreMadeToIntersect) {
  const RunRecording right = run();
  ASSERT_TRUE(check_recording(scene_, right, 0).faults.empty());
  RunRecording wrong = right;
  std::vector<MotionState>& states = wrong.steps.front().states[2];
  states[0].X_WB = states[1].X_WB * RigidPose(Vector3(0.3, 0, 0));
  EXPECT_TRUE(has_fault(wrong, "body 1 and body 2 intersect at t = "));
  wrong = right;
  wrong.steps.front().states[2][3].X_WB = right.steps.front().states[2][4].X_WB;
  EXPECT_TRUE(has_fault(wrong, "body 4 and body 5 intersect at t = "));
  wrong = right;
  wrong.steps.front().states[0][4].X_WB = RigidPose(Vector3(0, 0, -1));  // wholly inside
  EXPECT_TRUE(has_fault(wrong, "body 5 and floor intersect at t = 0"));
}

TEST_F(FallingBodies, LeaveNoGapInTheirRecording) {
  RunRecording wrong = run();
  wrong.steps.erase(wrong.steps.begin() + 1);
  EXPECT_TRUE(has_fault(wrong, "a step begins at "));
  wrong.steps.pop_back();
  EXPECT_TRUE(has_fault(wrong, "the last step ends at "));
  wrong.is_complete = false;
  EXPECT_TRUE(has_fault(wrong, "the recording has no end"));
  wrong.scene = "{}";
  EXPECT_TRUE(has_fault(wrong, "the recording is of another scene"));
}

}  // namespace
}  // namespace dyop::testing
