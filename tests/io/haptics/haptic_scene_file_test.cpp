// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/haptic_scene_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include "dyop/io/file_error.h"
#include "support/inputs/haptic_run_texts.h"
#include "support/message_of.h"

namespace dyop {
namespace {

TEST(HapticSceneFile, ReadsToolObstaclesAndOptions) {
  const HapticRun run = parse_haptic_run("scene.json", testing::kSmallHapticScene);
  EXPECT_EQ(run.scene.tool.size(), 2u);
  EXPECT_EQ(run.scene.tool[1].hinge, 0u);
  EXPECT_EQ(run.scene.hinges[0].angle, 0.3);
  ASSERT_EQ(run.scene.obstacles.size(), 2u);
  EXPECT_FALSE(run.scene.obstacles[0].triangles.empty());
  EXPECT_EQ(run.scene.obstacles[1].role, ObstacleRole::HardRegion);
  EXPECT_EQ(run.scene.obstacles[1].margin, 2);
  EXPECT_EQ(run.tissue.size(), 1u);
  EXPECT_EQ(run.runner.ticks, 2000);
  EXPECT_EQ(run.options.coupling.stiffness.x(), 0.5);
}

TEST(HapticSceneFile, ReadsATrocarAndHowADeviceMovesTheTool) {
  const std::string trocar = R"("tool": {"trocar": {"position": [1, 2, 3], "axis": [0, 0, 2]},)";
  const std::string device = R"("device": {"scale": 0.5, "rotation": [0, 0, 1]}, "rest_offset")";
  const std::string text =
      testing::replaced(testing::replaced(testing::kSmallHapticScene, "\"tool\": {", trocar),
                        "\"rest_offset\"", device);
  const HapticRun run = parse_haptic_run("scene.json", text);
  ASSERT_TRUE(run.scene.trocar);
  EXPECT_EQ(run.scene.trocar->p_W, Vector3(1, 2, 3));
  EXPECT_EQ(run.scene.trocar->axis_T, Vector3(0, 0, 2));
  ASSERT_TRUE(run.mapping);
  EXPECT_EQ(run.mapping->scale, 0.5);
  EXPECT_EQ(run.mapping->rotation_scale, 1);
  EXPECT_NEAR((run.mapping->R_WV * Vector3::UnitX()).y(), std::sin(1.0), 1e-12);
  EXPECT_FALSE(parse_haptic_run("scene.json", testing::kSmallHapticScene).mapping);
  const auto message = testing::message_of<FileError>(
      [&] { parse_haptic_run("scene.json", testing::replaced(text, "[0, 0, 2]", "[0, 0, 0]")); });
  EXPECT_NE(message.find("axis"), std::string::npos);
}

TEST(HapticSceneFile, ReadsFurtherToolsAndTheirPaths) {
  const std::string text = testing::two_tools_haptic_scene();
  const HapticRun run = parse_haptic_run("scene.json", text);
  ASSERT_EQ(run.scene.more_tools.size(), 1u);
  const HapticTool& other = run.scene.more_tools[0];
  EXPECT_EQ(other.parts.size(), 1u);
  EXPECT_EQ(other.X_WT.translation(), Vector3(40, 0, 80));
  ASSERT_TRUE(other.coupling);
  EXPECT_EQ(other.coupling->stiffness.x(), 0.2);
  EXPECT_EQ(other.coupling->period, run.runner.period);
  EXPECT_EQ(run.scene.tool_margin, 0.1);
  EXPECT_EQ(run.scene.tool_friction, 0.2);
  EXPECT_NEAR(run.device(50, 1).p_WD.x(), 20, 1e-9);
  EXPECT_NEAR(run.device(400, 1).p_WD.x(), 60, 1e-9);
  EXPECT_NEAR(run.device(600, 1).p_WD.x(), 60, 1e-9);  // waits there
  const auto message_of = [&](const std::string& from, const std::string& to) {
    return testing::message_of<FileError>(
        [&] { parse_haptic_run("scene.json", testing::replaced(text, from, to)); });
  };
  EXPECT_NE(message_of("more_paths", "paths").find("paths"), std::string::npos);
  EXPECT_NE(message_of("\"tool_margin\": 0.1", "\"tool_margin\": -1").find("tool_margin"),
            std::string::npos);
  EXPECT_NE(message_of("[[\n      {\"t\": 0", "[[], [\n      {\"t\": 0").find("more_paths"),
            std::string::npos);
}

// Two strokes of 0.3 and 0.4 s.
TEST(HapticSceneFile, TheDeviceGoesThroughTheStrokesAgainAndAgain) {
  const HapticRun run = parse_haptic_run("scene.json", testing::kSmallHapticScene);
  EXPECT_EQ(run.stroke_at(0), 0u);
  EXPECT_EQ(run.stroke_at(299), 0u);
  EXPECT_EQ(run.stroke_at(301), 1u);
  EXPECT_EQ(run.stroke_at(701), 0u);
  EXPECT_NEAR(run.device(100).p_WD.z(), 80 - 35 * 0.5, 1e-9);
  EXPECT_NEAR(run.device(100).angles[0], 0.15, 1e-9);
  EXPECT_NEAR(run.device(800).p_WD.z(), 80 - 35 * 0.5, 1e-6);
  EXPECT_NEAR(run.device(400).p_WD.y(), 20, 1e-9);
}

TEST(HapticSceneFile, BreathingReturnsToWhereItWas) {
  const HapticRun run = parse_haptic_run("scene.json", testing::kSmallHapticScene);
  std::vector<Vector3> shape = run.scene.obstacles[0].vertices;
  run.tissue[0].shape(50, shape);  // a whole period
  for (std::size_t k = 0; k < shape.size(); ++k) {
    EXPECT_LT((shape[k] - run.scene.obstacles[0].vertices[k]).norm(), 1e-9);
  }
  run.tissue[0].shape(12, shape);
  EXPECT_GT((shape[0] - run.scene.obstacles[0].vertices[0]).norm(), 1);
}

TEST(HapticSceneFile, CutsTakeAwayWhatIsInABall) {
  const HapticRun run = parse_haptic_run(
      "s.json", testing::cut_haptic_scene(R"({"t": 0.4, "position": [80, 0, 0], "radius": 20})"));
  const ToolObstacle& liver = run.scene.obstacles[0];
  const TissueFeed& feed = run.tissue[0];
  for (const int number : {1, 4, 6, 19, 21}) EXPECT_FALSE(feed.cut(number)) << number;
  const auto top = feed.cut(5), side = feed.cut(20);
  ASSERT_TRUE(top && side);
  EXPECT_EQ(top->vertices.size(), liver.vertices.size());
  EXPECT_LT(top->triangles.size(), liver.triangles.size());
  EXPECT_LT(side->triangles.size(), top->triangles.size());
  std::size_t in_ball = 0;
  for (const TriangleIndices& t : liver.triangles) {
    in_ball += std::any_of(t.begin(), t.end(), [&](std::int32_t corner) {
      return (liver.vertices[std::size_t(corner)] - Vector3(0, 0, 35)).norm() < 20;
    });
  }
  EXPECT_EQ(top->triangles.size(), liver.triangles.size() - in_ball);
  // Where the snapshot before it was.
  std::vector<Vector3> shape = liver.vertices;
  feed.shape(4, shape);
  EXPECT_EQ(top->vertices, shape);
}

TEST(HapticSceneFile, SaysWhatIsWrongWithACut) {
  const auto message = [](const char* second) {
    return testing::message_of<FileError>(
        [&] { parse_haptic_run("s.json", testing::cut_haptic_scene(second)); });
  };
  const auto expect = [&](const char* second, const char* words) {
    EXPECT_NE(message(second).find(words), std::string::npos) << message(second);
  };
  expect(R"({"t": 0.105, "position": [80, 0, 0], "radius": 20})", "at least a snapshot apart");
  expect(R"({"t": 0, "position": [80, 0, 0], "radius": 20})", "cuts[1].t");
  expect(R"({"t": 1e300, "position": [80, 0, 0], "radius": 20})", "cuts[1].t");
  expect(R"({"t": 1, "position": [500, 0, 0], "radius": 20})", "no triangle has a corner");
  expect(R"({"t": 1, "position": [0, 0, 0], "radius": 200})", "nothing is left");
  expect(R"({"t": 1, "position": [0, 0, 0], "radius": -1})", "radius");
  expect(R"({"t": 1, "position": [0, 0, 0]})", "radius");
  expect(R"({"t": 1, "position": [0, 0, 0], "radius": 9, "depth": 1})", "depth");
}

TEST(HapticSceneFile, ReadsTissueThatAnswers) {
  const HapticRun run = parse_haptic_run("s.json", testing::elastic_haptic_scene());
  ASSERT_EQ(run.tissue.size(), 1u);
  EXPECT_EQ(run.tissue[0].period, 0.02);
  ASSERT_TRUE(run.tissue[0].model);
  EXPECT_TRUE(run.tissue[0].formula.empty());
  std::vector<Vector3> vertices = run.scene.obstacles[0].vertices;
  const std::vector<Vector3> before = vertices;
  TissueNews nothing;
  nothing.tools.resize(1);
  run.tissue[0].model->step(nothing, vertices);
  for (std::size_t k = 0; k < before.size(); ++k) {
    EXPECT_LE((vertices[k] - before[k]).norm(), 1e-9);
  }
}

TEST(HapticSceneFile, SaysWhatIsWrongWithElasticTissue) {
  const auto expect = [](const std::string& from, const std::string& to, const std::string& words) {
    const std::string message = testing::message_of<FileError>([&] {
      parse_haptic_run("s.json", testing::replaced(testing::elastic_haptic_scene(), from, to));
    });
    EXPECT_NE(message.find(words), std::string::npos) << message;
  };
  expect("0.45", "0.5", "poissons_ratio must be between -1 and 0.5, not 0.5");
  expect("0.005", "-1", "youngs_modulus");
  expect("\"cube\": 20", "\"cube\": 0.01", "cube_edge 0.01");
  expect("\"cube\"", "\"cell\"", "cell");
  expect("\"elastic\"", "\"breathing\": {}, \"elastic\"", "not both");
  expect("\"liver\": {\"triangles\": 1000}", "\"wall\": {\"triangles\": 1000}", "closed");
}

std::string scene_with_blades(const std::string& blades) {
  return testing::replaced(testing::elastic_haptic_scene(), "\"cube\"",
                           "\"cuts\": [" + blades + "], \"cube\"");
}

TEST(HapticSceneFile, CutsElasticTissueWithABlade) {
  const HapticRun run =
      parse_haptic_run("s.json", scene_with_blades(R"({"t": 0.001, "blade": {"position": [0, 0, 40],
                                      "rotation": [0, 0, 0.3], "size": [0.5, 60, 40]}})"));
  TissueNews nothing;
  nothing.tools.resize(1);
  const auto mesh = run.tissue[0].model->cut(nothing);
  ASSERT_TRUE(mesh);
  EXPECT_GT(mesh->triangles.size(), run.scene.obstacles[0].triangles.size());
  EXPECT_TRUE(TriangleMesh(mesh->vertices, mesh->triangles).is_closed());
  EXPECT_FALSE(run.tissue[0].model->cut(nothing));
}

TEST(HapticSceneFile, SaysWhatIsWrongWithABlade) {
  const auto expect = [](const std::string& blades, const std::string& words) {
    const std::string message = testing::message_of<FileError>(
        [&] { parse_haptic_run("s.json", scene_with_blades(blades)); });
    EXPECT_NE(message.find(words), std::string::npos) << message;
  };
  const std::string good = R"({"t": 1, "blade": {"position": [0, 0, 40], "size": [1, 60, 40]}})";
  expect(good + R"(, {"t": 0.5, "blade": {"size": [1, 60, 40]}})", "cuts[1].t");
  expect(R"({"t": 0, "blade": {"size": [1, 60, 40]}})", "cuts[0].t");
  expect(R"({"t": 1, "blade": {"size": [0, 60, 40]}})", "cuts[0].blade.size");
  expect(R"({"t": 1, "blade": {"size": [1, 60]}})", "cuts[0].blade.size");
  expect(R"({"t": 1, "blade": {"position": [0, 0, 0]}})", "size");
  expect(R"({"t": 1, "ball": {"radius": 1}})", "ball");
  expect(R"({"t": 1, "blade": {"size": [1, 1, 1], "edge": 1}})", "edge");
  expect("", "cuts");
}

TEST(HapticSceneFile, TheScenesOfTheExamplesAreValid) {
  const std::string folder = DYOP_SURGERY_SCENES;
  EXPECT_EQ(load_haptic_run(folder + "/cut.json").tissue.size(), 2u);
  EXPECT_EQ(load_haptic_run(folder + "/needle.json").tissue.size(), 1u);
  EXPECT_EQ(load_haptic_run(folder + "/soft-liver.json").tissue.size(), 2u);
  EXPECT_EQ(load_haptic_run(folder + "/two-hands.json").scene.tools().size(), 2u);
  const HapticRun run = load_haptic_run(folder + "/scene.json");
  std::size_t triangles = 0;
  for (const ToolObstacle& obstacle : run.scene.obstacles) triangles += obstacle.triangles.size();
  EXPECT_GT(triangles, 40000u);
  EXPECT_EQ(run.strokes.size(), 5u);
}

// 17 mm into a channel 3 mm wide: without a force, but for the wall that it is pressed against, which
// yields and comes back.
TEST(HapticSceneFile, ANeedleFollowsAChannel) {
  HapticRun run = load_haptic_run(std::string(DYOP_SURGERY_SCENES) + "/needle.json");
  HapticSession session(run.scene, run.options);
  run.runner.is_paced = false;
  Scalar most_on_the_way = 0, pressed = 0, yielded = 0, deepest = kInfinity;
  std::int64_t unproven = 0;
  const auto device = [&](std::int64_t tick) { return run.device(tick); };
  const auto look = [&](const TickRecord& record) {
    const HapticTick& tick = record.tick;
    const Scalar force = tick.wrench.force_W.norm();
    const Vector3& tip_W = tick.tool.X_WT.translation();
    unproven += tick.status == HapticStatus::Overlapping;
    deepest = std::min(deepest, tip_W.z());
    if (tick.time < 3 || tick.time > 5) most_on_the_way = std::max(most_on_the_way, force);
    if (force > pressed) yielded = tip_W.x();
    pressed = std::max(pressed, force);
  };
  run_session(session, device, run.tissue, look, run.runner);
  EXPECT_EQ(unproven, 0);
  EXPECT_LT(deepest, 19.1);
  EXPECT_LT(most_on_the_way, 0.01);
  EXPECT_GT(pressed, 0.2);
  EXPECT_LT(pressed, 1);
  EXPECT_GT(yielded, 3);
}

TEST(HapticSceneFile, NamesTheKeyThatIsWrong) {
  const auto message_with = [](const std::string& from, const std::string& to) {
    const std::string text = testing::replaced(testing::kSmallHapticScene, from, to);
    return testing::message_of<FileError>([&] { parse_haptic_run("scene.json", text); });
  };
  EXPECT_NE(message_with("\"role\": \"hard\"", "\"role\": \"firm\"").find("role"),
            std::string::npos);
  EXPECT_NE(message_with("\"rest_offset\": 0.05", "\"rest_offset\": 0").find("rest_offset"),
            std::string::npos);
  EXPECT_NE(message_with("\"angles\": [0.3]", "\"angles\": []").find("angles"), std::string::npos);
  EXPECT_NE(message_with("\"t\": 0.2", "\"t\": 0").find("ascend"), std::string::npos);
  EXPECT_NE(message_with("{\"triangles\": 500}", "{\"triangles\": 5}").find("32"),
            std::string::npos);
}

}  // namespace
}  // namespace dyop
