// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/recording_lines.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "dyop/io/recording.h"
#include "io/scene/small_run.h"
#include "support/inputs/world_scenes.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

using Json = nlohmann::ordered_json;

class RecordingLines : public ::testing::Test {
 protected:
  // The lines of a short run, whose end may be missing.
  std::vector<Json> lines(bool is_complete = true) const {
    const std::filesystem::path file = directory_.path() / "run.h5";
    const Scene scene = testing::small_scene();
    {
      RecordingWriter writer(file, run_header(scene));
      writer.write(testing::small_report(), scene.bodies);
      if (is_complete) writer.finish();
    }
    std::stringstream text;
    write_json_lines(text, RecordingReader(file));
    std::vector<Json> records;
    for (std::string line; std::getline(text, line);) records.push_back(Json::parse(line));
    return records;
  }

  testing::TemporaryDirectory directory_;
};

TEST_F(RecordingLines, AreInTheOrderOfTime) {
  std::vector<std::string> kinds;
  for (const Json& line : lines()) kinds.push_back(line.at("record"));
  EXPECT_EQ(kinds, (std::vector<std::string>{"header", "too_near", "step", "impact", "step", "woke",
                                             "fell_asleep", "end"}));
}

TEST_F(RecordingLines, HoldEveryNumberExactly) {
  const std::vector<Json> records = lines();
  EXPECT_EQ(records[0].at("title"), "Small");
  EXPECT_EQ(records[0].at("bodies")[1].at("kind"), "static");
  const ImpactEvent impact = testing::small_impact();
  EXPECT_EQ(records[3].at("number"), 1);
  EXPECT_EQ(records[3].at("toi").at("t_safe"), impact.toi.t_safe);
  EXPECT_EQ(records[3].at("contacts")[0].at("impulse_W")[2], impact.contacts[0].impulse_W.z());
  const auto motion = testing::small_motion();
  for (std::size_t k = 0; k < 5; ++k) {
    const Scalar t = records[2].at("t")[k];
    const MotionState state = motion->state(t);
    const Json& row = records[2].at("states")[k][0];
    for (std::size_t i = 0; i < 3; ++i) {
      const auto axis = Eigen::Index(i);
      EXPECT_NEAR(row[i], state.X_WB.translation()[axis], 1e-15);
      EXPECT_NEAR(row[7 + i], state.twist.v_WB[axis], 1e-14);
      EXPECT_NEAR(row[10 + i], state.twist.w_WB[axis], 1e-14);
    }
  }
}

// Also of a slot that was empty from the start, and of one that is new.
TEST_F(RecordingLines, AreNullWhereABodyIsNotThere) {
  const std::filesystem::path file = directory_.path() / "run.h5";
  const auto ball = std::make_shared<Sphere>(0.5);
  World world(testing::earth_options());
  for (const Scalar x : {0.0, 3.0, 6.0})
    world.add_body(testing::dynamic_body("ball", ball, {x, 0, 0}));
  world.remove_body(BodyId(1));
  RecordingWriter writer(file, {});
  writer.write(world.advance(0.01), world);
  world.add_body(testing::dynamic_body("third", ball, {9, 0, 0}));
  world.add_body(testing::dynamic_body("fourth", ball, {12, 0, 0}));
  writer.write(world.advance(0.01), world);
  writer.finish();
  std::stringstream text;
  write_json_lines(text, RecordingReader(file));
  std::vector<std::vector<bool>> is_null;
  for (std::string line; std::getline(text, line);) {
    const Json record = Json::parse(line);
    if (record.at("record") != "step") continue;
    is_null.emplace_back();
    for (const Json& state : record.at("states")[2]) is_null.back().push_back(state.is_null());
  }
  EXPECT_EQ(is_null, (std::vector<std::vector<bool>>{{false, true, false, true},
                                                     {false, false, false, false}}));
}

TEST_F(RecordingLines, OfAKilledRunHaveNoEnd) {
  EXPECT_NE(lines(false).back().at("record"), "end");
}

TEST(RunHeader, IsThatOfTheScene) {
  Scene scene = testing::small_scene();
  scene.options.target_distance = 0.5;
  const RunHeader header = run_header(scene);
  EXPECT_EQ(header.title, "Small");
  EXPECT_EQ(header.scene, scene.source);
  EXPECT_EQ(header.target_distance, 0.5);
  EXPECT_EQ(header.end_time, 2);
  EXPECT_EQ(header.step, 1);
}

}  // namespace
}  // namespace dyop
