// SPDX-License-Identifier: BSD-3-Clause

// Runs of small generated scenes, checked as any recording is; and that the check sees what is
// wrong.

#include "support/oracles/recording_oracle.h"

#include <gtest/gtest.h>

#include <sstream>

#include "dyop/io/recording.h"
#include "dyop/io/recording_lines.h"
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

  RecordingReader run(int steps, bool ends) {
    const std::filesystem::path file = directory_.path() / "run.h5";
    RecordingWriter writer(file, run_header(scene_));
    World world = make_world(scene_);
    for (int k = 0; k < steps; ++k) {
      const AdvanceReport report = world.advance(scene_.step);
      EXPECT_EQ(report.status, AdvanceStatus::Completed);
      writer.write(report, world);
    }
    if (ends) writer.finish();
    return RecordingReader(file);
  }
  RecordingReader whole_run() { return run(14, true); }

  // Whether the recorded poses at a few times, with one of one body replaced, show a fault.
  bool has_fault(const RecordingReader& run, BodyId body, std::size_t time, const RigidPose& pose,
                 const std::string& part) const {
    const std::vector<Scalar> times{0, 0.3, 0.7};
    const RecordingReport report = check_poses(scene_, times, [&](BodyId id, std::size_t k) {
      return id == body && k == time ? pose : run.pose(id, times[k]);
    });
    return mentions(report, part);
  }

  static bool mentions(const RecordingReport& report, const std::string& part) {
    return std::any_of(report.faults.begin(), report.faults.end(), [&](const std::string& fault) {
      return fault.find(part) != std::string::npos;
    });
  }

  TemporaryDirectory directory_;
  std::filesystem::path scene_file_;
  Scene scene_;
};

TEST_F(FallingBodies, NeverIntersect) {
  const RecordingReader recording = whole_run();
  EXPECT_GE(recording.impacts().size(), 10u);
  const RecordingReport report = check_recording(scene_, recording, 40);
  EXPECT_GT(report.examined_pairs, 1000);
  for (const std::string& fault : report.faults) ADD_FAILURE() << fault;
}

TEST_F(FallingBodies, AreCaughtWhereTheyAreMadeToIntersect) {
  const RecordingReader right = whole_run();
  ASSERT_TRUE(check_recording(scene_, right, 0).faults.empty());
  const RigidPose beside = right.pose(BodyId(1), 0.3) * RigidPose(Vector3(0.3, 0, 0));
  EXPECT_TRUE(has_fault(right, BodyId(0), 1, beside, "body 1 and body 2 intersect at t = 0.3"));
  const RigidPose same = right.pose(BodyId(4), 0.3);
  EXPECT_TRUE(has_fault(right, BodyId(3), 1, same, "body 4 and body 5 intersect at t = 0.3"));
  const RigidPose inside(Vector3(0, 0, -1));
  EXPECT_TRUE(has_fault(right, BodyId(4), 0, inside, "body 5 and floor intersect at t = 0"));
}

TEST_F(FallingBodies, MissNothingOfTheirRecording) {
  EXPECT_TRUE(mentions(check_recording(scene_, run(3, false), 0), "the recording has no end"));
  const RecordingReader recording = whole_run();
  scene_.source = "{}";
  EXPECT_TRUE(mentions(check_recording(scene_, recording, 0), "of another scene"));
}

}  // namespace
}  // namespace dyop::testing
