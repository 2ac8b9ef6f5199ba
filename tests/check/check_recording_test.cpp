// SPDX-License-Identifier: BSD-3-Clause

// Verdicts of dyop-check on recorded runs: of Worlds, which are right, and of motions that are
// made up, which are wrong by as much as the test says.

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "check/check.h"
#include "dyop/geometry/box.h"
#include "dyop/geometry/cylinder.h"
#include "dyop/geometry/sphere.h"
#include "dyop/io/recording_writer.h"
#include "dyop/io/scene_generator.h"
#include "dyop/io/scene_recording.h"
#include "dyop/motion/hermite_motion.h"
#include "dyop/motion/rest_motion.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

constexpr int kProven = 0;
constexpr int kRefuted = 1;
constexpr int kUnusable = 2;

struct Answer {
  int code = 0;
  std::string text;
  std::string error;
};

Answer check(const std::filesystem::path& file, double scale = 1) {
  std::ostringstream out;
  std::ostringstream errors;
  const int code = dyop_check::check_file(file.string(), scale, out, errors);
  return {code, out.str(), errors.str()};
}

class CheckRecording : public ::testing::Test {
 protected:
  std::filesystem::path file() const { return directory_.path() / "run.h5"; }

  // A mover above a body at rest at the origin, target 0.01.
  void record(std::shared_ptr<const Shape> mover, std::shared_ptr<const Shape> rester,
              const std::vector<CommittedStep>& steps, const std::string& scene = "") const {
    std::vector<BodyDefinition> bodies(2);
    bodies[0].name = "mover";
    bodies[0].shape = std::move(mover);
    bodies[1].name = "rester";
    bodies[1].kind = BodyKind::Static;
    bodies[1].shape = std::move(rester);
    RunHeader header;
    header.scene = scene;
    header.target_distance = 0.01;
    RecordingWriter writer(file(), header);
    AdvanceReport report;
    report.status = AdvanceStatus::Completed;
    report.t = steps.back().interval.end;
    report.steps = steps;
    writer.write(report, bodies);
    writer.finish();
  }

  // Down to `lowest` at half time, along a parabola, while it turns about z by an angle.
  static CommittedStep swing(Scalar lowest, Scalar turn, Scalar begin = 0) {
    const auto node = [&](Scalar sign) {
      HermiteNode result;
      result.p_WB = Vector3(0, 0, lowest + 1);
      result.v_WB = Vector3(0, 0, 4 * sign);
      result.theta = Vector3(0, 0, sign > 0 ? turn : 0);
      result.theta_rate = Vector3(0, 0, turn);
      return result;
    };
    const TimeInterval interval{begin, begin + 1};
    CommittedStep step;
    step.interval = interval;
    step.motions = {std::make_shared<HermiteMotion>(HermiteMotion::from_chart(
                        interval, Matrix3::Identity(), node(-1), node(1))),
                    std::make_shared<RestMotion>(RigidPose())};
    return step;
  }

  testing::TemporaryDirectory directory_;
};

TEST_F(CheckRecording, ProvesRunsOfWorlds) {
  for (const auto& [kind, n] : std::vector<std::pair<const char*, int>>{
           {"arch", 5}, {"cards", 1}, {"pile", 4}, {"cradle", 3}, {"gears", 2}, {"domino", 3}}) {
    const std::filesystem::path scene_file = directory_.path() / "scene.json";
    write_generated_scene(generate_scene(kind, n), scene_file);
    const Scene scene = load_scene(scene_file);
    World world = make_world(scene);
    {
      RecordingWriter writer(file(), run_header(scene));
      for (int k = 0; k < 60; ++k) writer.write(world.advance(scene.step), world);
      writer.finish();
    }
    const Answer answer = check(file());
    EXPECT_EQ(answer.code, kProven) << kind << '\n' << answer.text << answer.error;
    EXPECT_NE(answer.text.find("geometry   proven"), std::string::npos) << answer.text;
  }
}

// Far at both ends of the step; nearer than the target in between by a millionth.
TEST_F(CheckRecording, RefutesADipWithinAStep) {
  const auto ball = std::make_shared<Sphere>(0.5);
  const auto plate = std::make_shared<Box>(Vector3(2, 2, 0.1));
  const auto cube = std::make_shared<Box>(Vector3(0.5, 0.4, 0.3));
  const auto can = std::make_shared<Cylinder>(0.4, 0.3);
  const std::vector<std::tuple<std::shared_ptr<const Shape>, Scalar, Scalar>> movers{
      {ball, 0.5, 3}, {cube, 0.3, 2}, {can, 0.3, 1}};
  for (const auto& [mover, height, turn] : movers) {
    const Scalar touching = 0.1 + height;
    record(mover, plate, {swing(touching + 0.01 + 1e-6, turn)});
    const Answer kept = check(file());
    EXPECT_EQ(kept.code, kProven) << kept.text << kept.error;
    record(mover, plate, {swing(touching + 0.01 - 1e-6, turn)});
    const Answer dipped = check(file());
    EXPECT_EQ(dipped.code, kRefuted) << dipped.text << dipped.error;
    EXPECT_NE(dipped.text.find("refuted: mover and rester are at most 0.00999"), std::string::npos)
        << dipped.text;
    EXPECT_EQ(check(file(), 0).code, kProven);  // but nothing touched
    record(mover, plate, {swing(touching - 1e-6, turn)});
    EXPECT_EQ(check(file(), 0).code, kRefuted);
  }
}

TEST_F(CheckRecording, RefutesAJumpBetweenSteps) {
  const auto ball = std::make_shared<Sphere>(0.5);
  record(ball, ball, {swing(2, 0), swing(2.001, 0, 1)});
  const Answer answer = check(file());
  EXPECT_EQ(answer.code, kRefuted) << answer.text;
  EXPECT_NE(answer.text.find("jump: mover by 0.001"), std::string::npos) << answer.text;
  record(ball, ball, {swing(2, 0), swing(2, 0, 1)});
  EXPECT_EQ(check(file()).code, kProven);
}

TEST_F(CheckRecording, LeavesOutWhatTheSceneDoesNotTest) {
  const auto ball = std::make_shared<Sphere>(0.5);
  record(ball, ball, {swing(0.5, 0)});
  EXPECT_EQ(check(file()).code, kRefuted);
  record(ball, ball, {swing(0.5, 0)}, R"({"filters":[["mover","rester"]]})");
  EXPECT_EQ(check(file()).code, kProven);
  record(ball, ball, {swing(1.005, 0)},
         R"({"target_distances":[{"a":"rester","b":"mover","distance":0.001}]})");
  EXPECT_EQ(check(file()).code, kProven);
}

TEST_F(CheckRecording, RefusesWhatItCannotRead) {
  EXPECT_EQ(check(directory_.path() / "none.h5").code, kUnusable);
  const std::filesystem::path text = directory_.write("text.h5", "not HDF5");
  EXPECT_EQ(check(text).code, kUnusable);
  EXPECT_NE(check(text).error.find("no readable HDF5 file"), std::string::npos);
  record(std::make_shared<Sphere>(0.5), std::make_shared<Sphere>(0.5), {swing(2, 0)});
  const std::string whole = testing::TemporaryDirectory::read(file());
  for (const std::size_t length : {whole.size() / 4, whole.size() / 2}) {
    EXPECT_EQ(check(directory_.write("part.h5", whole.substr(0, length))).code, kUnusable);
  }
}

}  // namespace
}  // namespace dyop
