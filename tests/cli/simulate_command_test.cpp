// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "cli/command.h"
#include "support/inputs/cube_files.h"

namespace dyop {
namespace {

using testing::CommandResult;
using testing::run_command;
using testing::TemporaryDirectory;
using Json = nlohmann::ordered_json;

// A ball of radius 0.5 falls from a height of 1.5 above a box with its top at z = 0, under a
// gravity of 2: the bottom of the ball begins at z = 1 and meets the box at t = 1.
Json falling_ball() {
  return Json::parse(R"({
    "title": "A ball falls on a box",
    "time": {"end": 1.5, "step": 0.125}, "target_distance": 1e-7, "rest_offset": 1e-6,
    "bodies": [
      {"name": "ball", "shape": {"sphere": {"radius": 0.5}}, "density": 1,
       "pose": {"position": [0, 0, 1.5]}, "restitution": 1, "friction": 0},
      {"name": "box", "kind": "static", "shape": {"box": {"half_extents": [5, 5, 1]}},
       "pose": {"position": [0, 0, -1]}, "restitution": 1}
    ],
    "forces": {"gravity": [0, 0, -2]}})");
}

class SimulateCommand : public ::testing::Test {
 protected:
  std::string write(const Json& scene) const {
    return directory_.write("scene.json", scene.dump(1)).string();
  }
  void expect_error(const Json& scene, const std::string& part) const {
    const CommandResult result = run_command({"simulate", write(scene)});
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_TRUE(result.err.starts_with("dyop: error: " + write(scene) + ": ")) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_NE(result.err.find(part), std::string::npos) << result.err << "has no\n" << part;
  }

  TemporaryDirectory directory_;
};

TEST_F(SimulateCommand, TellsOfAnImpact) {
  const CommandResult result = run_command({"simulate", write(falling_ball()), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");  // no progress bar: not a terminal
  const Json json = Json::parse(result.out);
  EXPECT_EQ(json.at("status"), "Completed");
  EXPECT_EQ(json.at("impacts"), 1);
  EXPECT_NEAR(json.at("first_impact").get<double>(), 1, 1e-5);
  EXPECT_EQ(json.at("stalls"), 0);
  EXPECT_TRUE(json.contains("shortest_gap"));
  double parts = 0;
  for (const char* part : {"broad_phase", "flight", "contacts", "solve", "ends", "proofs"}) {
    parts += json.at("step_seconds").at(part).get<double>();
  }
  EXPECT_GT(parts, 0);
  EXPECT_GT(json.at("step_seconds").at("total").get<double>(), 0);
}

TEST_F(SimulateCommand, KeepsNothingUnlessAsked) {
  const CommandResult words = run_command({"simulate", write(falling_ball())});
  EXPECT_EQ(words.exit_code, 0) << words.err;
  EXPECT_NE(words.out.find("1 impact. Completed at t = 1.5."), std::string::npos) << words.out;
  const CommandResult json = run_command({"simulate", write(falling_ball()), "--json"});
  EXPECT_TRUE(Json::parse(json.out).at("recording").is_null());
}

TEST_F(SimulateCommand, StopsAtAnImpactIfTheSceneAsks) {
  Json scene = falling_ball();
  scene["policy"] = "stop";
  const CommandResult result =
      run_command({"simulate", write(scene), "--json", "--fail-on-impact"});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_EQ(Json::parse(result.out).at("status"), "StoppedAtImpact");
  EXPECT_NEAR(Json::parse(result.out).at("t").get<double>(), 1, 1e-5);
}

TEST_F(SimulateCommand, FindsMeshesByOptionAndEnvironment) {
  const TemporaryDirectory meshes;
  meshes.write("cube.obj", testing::cube_obj());
  Json scene = falling_ball();
  scene["bodies"][1]["shape"] = {{"mesh", "cube.obj"}};
  scene["bodies"][1].erase("pose");
  scene["time"]["end"] = 0.125;
  expect_error(scene, "bodies[1].shape.mesh: no mesh file cube.obj in ");
  scene["bodies"][0]["pose"]["position"] = {0, 0, 3};
  EXPECT_EQ(
      run_command({"simulate", write(scene), "--mesh-path", meshes.path().string()}).exit_code, 0);
  setenv("DYOP_MESH_PATH", ("/nowhere:" + meshes.path().string()).c_str(), 1);
  EXPECT_EQ(run_command({"simulate", write(scene)}).exit_code, 0);
  unsetenv("DYOP_MESH_PATH");
}

TEST_F(SimulateCommand, NamesWhatIsWrongWithAScene) {
  Json scene = falling_ball();
  scene["bodys"] = 1;
  expect_error(scene, "unknown key 'bodys'");
  scene = falling_ball();
  scene["bodies"][0]["density"] = 0;
  expect_error(scene, "bodies[0].density: expected a number > 0, found 0");
  scene = falling_ball();
  scene["bodies"][0]["pose"]["quaternion"] = {2, 0, 0, 0};
  expect_error(scene, "bodies[0].pose.quaternion: pose rotation must be a unit quaternion");
  scene = falling_ball();
  scene["bodies"][1]["shape"] = {{"mesh", "gone.obj"}};
  expect_error(scene, "bodies[1].shape.mesh: no mesh file gone.obj in ");
  scene = falling_ball();
  scene["bodies"][1] = Json::parse(R"({"name": "arm", "kind": "kinematic",
    "shape": {"sphere": {"radius": 1}},
    "motion": {"kind": "interpolated", "interval": [2, 1], "from": {}, "to": {}}})");
  expect_error(scene, "bodies[1].motion.interval: time interval must not be reversed");
  scene = falling_ball();
  scene["bodies"][0]["density"] = 1e-320;
  expect_error(scene, "bodies[0].density: mass properties are out of the range of double");
  scene = falling_ball();
  scene["bodies"][0]["shell"] = true;
  expect_error(scene, "bodies[0].shell: only a mesh can be a shell");
  scene = falling_ball();
  scene["integrator"] = {{"max_step", 1e-300}};
  expect_error(scene, "integrator.max_step: expected a step of at least one part in 1e9");
  scene = falling_ball();
  scene["bodies"][0]["velocity"] = {{"angular", {1e200, 0, 0}}};
  expect_error(scene, "Hermite motion");  // only the run shows that this is too fast
}

TEST_F(SimulateCommand, TellsWhatBeganTooNearAndWhereBodiesEnded) {
  Json scene = falling_ball();
  scene["bodies"][0]["pose"]["position"] = {0, 0, 0};
  const CommandResult result = run_command({"simulate", write(scene), "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  EXPECT_EQ(json.at("too_near"), 1);
  ASSERT_EQ(json.at("bodies").size(), 2U);
  EXPECT_EQ(json.at("bodies")[0].at("name"), "ball");
  EXPECT_EQ(json.at("bodies")[0].at("position").size(), 3U);
  EXPECT_EQ(json.at("bodies")[0].at("quaternion").size(), 4U);
  EXPECT_FALSE(json.at("bodies")[0].at("asleep").get<bool>());
}

}  // namespace
}  // namespace dyop
