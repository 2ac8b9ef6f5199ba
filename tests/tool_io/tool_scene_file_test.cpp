// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/tool_io/tool_scene_file.h"

#include <gtest/gtest.h>

#include <string>

#include "dyop/io/file_error.h"
#include "support/inputs/tool_run_texts.h"
#include "support/message_of.h"

namespace dyop {
namespace {

TEST(ToolSceneFile, ReadsToolObstaclesAndOptions) {
  const ToolRun run = parse_tool_run("scene.json", testing::kSmallToolScene);
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

// Two strokes of 0.3 and 0.4 s.
TEST(ToolSceneFile, TheDeviceGoesThroughTheStrokesAgainAndAgain) {
  const ToolRun run = parse_tool_run("scene.json", testing::kSmallToolScene);
  EXPECT_EQ(run.stroke_at(0), 0u);
  EXPECT_EQ(run.stroke_at(299), 0u);
  EXPECT_EQ(run.stroke_at(301), 1u);
  EXPECT_EQ(run.stroke_at(701), 0u);
  EXPECT_NEAR(run.device(100).p_WD.z(), 80 - 35 * 0.5, 1e-9);
  EXPECT_NEAR(run.device(100).angles[0], 0.15, 1e-9);
  EXPECT_NEAR(run.device(800).p_WD.z(), 80 - 35 * 0.5, 1e-6);
  EXPECT_NEAR(run.device(400).p_WD.y(), 20, 1e-9);
}

TEST(ToolSceneFile, BreathingReturnsToWhereItWas) {
  const ToolRun run = parse_tool_run("scene.json", testing::kSmallToolScene);
  std::vector<Vector3> shape = run.scene.obstacles[0].vertices;
  run.tissue[0].shape(50, shape);  // a whole period
  for (std::size_t k = 0; k < shape.size(); ++k) {
    EXPECT_LT((shape[k] - run.scene.obstacles[0].vertices[k]).norm(), 1e-9);
  }
  run.tissue[0].shape(12, shape);
  EXPECT_GT((shape[0] - run.scene.obstacles[0].vertices[0]).norm(), 1);
}

TEST(ToolSceneFile, TheSceneOfTheExampleIsValid) {
  const ToolRun run = load_tool_run(DYOP_SURGERY_SCENE);
  std::size_t triangles = 0;
  for (const ToolObstacle& obstacle : run.scene.obstacles) triangles += obstacle.triangles.size();
  EXPECT_GT(triangles, 40000u);
  EXPECT_EQ(run.strokes.size(), 5u);
}

TEST(ToolSceneFile, NamesTheKeyThatIsWrong) {
  const auto message_with = [](const std::string& from, const std::string& to) {
    std::string text = testing::kSmallToolScene;
    text.replace(text.find(from), from.size(), to);
    return testing::message_of<FileError>([&] { parse_tool_run("scene.json", text); });
  };
  EXPECT_NE(message_with("\"role\": \"hard\"", "\"role\": \"firm\"").find("role"),
            std::string::npos);
  EXPECT_NE(message_with("\"standoff\": 0.05", "\"standoff\": 0").find("standoff"),
            std::string::npos);
  EXPECT_NE(message_with("\"angles\": [0.3]", "\"angles\": []").find("angles"), std::string::npos);
  EXPECT_NE(message_with("\"t\": 0.2", "\"t\": 0").find("ascend"), std::string::npos);
  EXPECT_NE(message_with("{\"triangles\": 500}", "{\"triangles\": 5}").find("32"),
            std::string::npos);
}

}  // namespace
}  // namespace dyop
