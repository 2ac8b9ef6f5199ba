// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <signal.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/command.h"

namespace dyop {
namespace {

using testing::Command;
using testing::CommandResult;
using testing::run_command;
using testing::TemporaryDirectory;
using Json = nlohmann::ordered_json;

// A ball of radius 0.1 goes round at distance 1 from a ball at the origin; another one slides along
// x from it, and a third one does as the second.
constexpr const char* kRobot = R"(<robot name="r">
<link name="base"><inertial><mass value="2"/></inertial>
  <collision><geometry><sphere radius="0.1"/></geometry></collision></link>
<link name="arm"><inertial><mass value="1"/></inertial>
  <collision><origin xyz="1 0 0"/><geometry><sphere radius="0.1"/></geometry></collision></link>
<link name="hand"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
<link name="thumb"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
  <limit lower="-2" upper="2"/></joint>
<joint name="slide" type="prismatic"><origin xyz="2 0 0"/><parent link="arm"/><child link="hand"/>
  <axis xyz="1 0 0"/><limit lower="-1.5" upper="0.5"/></joint>
<joint name="copy" type="prismatic"><parent link="hand"/><child link="thumb"/><axis xyz="1 0 0"/>
  <limit lower="-2" upper="2"/><mimic joint="slide" multiplier="0.5"/></joint>
</robot>)";

// A ball of radius 0.1 at (0, 1, 0), where `arm` is after a quarter turn.
constexpr const char* kScene = R"({"time": {"end": 1, "step": 1}, "bodies": [
  {"name": "post", "kind": "static", "shape": {"sphere": {"radius": 0.1}},
   "pose": {"position": [0, 1, 0]}}]})";

class RobotCommand : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) const {
    return directory_.write(name, text).string();
  }
  CommandResult check(const std::string& path_name, const std::string& path,
                      std::vector<std::string> more = {"--json"}) const {
    std::vector<std::string> words{"robot",   "check", robot_, write(path_name, path),
                                   "--scene", scene_};
    words.insert(words.end(), more.begin(), more.end());
    return run_command(words);
  }
  void expect_refused(const std::string& path_name, const std::string& path,
                      const std::string& part) const {
    const CommandResult result = check(path_name, path);
    EXPECT_EQ(result.exit_code, 2) << path;
    EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
    EXPECT_NE(result.err.find(path_name), std::string::npos) << result.err;
  }

  TemporaryDirectory directory_;
  std::string robot_ = write("r.urdf", kRobot);
  std::string scene_ = write("scene.json", kScene);
};

TEST_F(RobotCommand, TellsWhatARobotIs) {
  const CommandResult result = run_command({"robot", "info", robot_, "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  EXPECT_EQ(json.at("free_coordinates"), 2);
  EXPECT_EQ(json.at("links").size(), 4u);
  EXPECT_EQ(json.at("links")[0].at("mass"), 2);
  EXPECT_EQ(json.at("joints")[2].at("mimics"), "slide");
  // The hand's origin gets 2.5 away from the base; nothing of the ball in its box is farther.
  const double reach = json.at("links")[2].at("reach");
  EXPECT_GE(reach, 2.6);
  EXPECT_LE(reach, 3.5 + 0.1 * std::sqrt(3) + 1e-9);
  const CommandResult text = run_command({"robot", "info", robot_});
  EXPECT_NE(text.out.find("mass 3"), std::string::npos) << text.out;
}

TEST_F(RobotCommand, DecidesPairsAndRefutesAClaim) {
  const std::string srdf = write("r.srdf", R"(<robot name="r">
    <disable_collisions link1="arm" link2="base" reason="Never"/>
    <disable_collisions link1="hand" link2="arm" reason="Never"/></robot>)");
  const std::string out = (directory_.path() / "out.srdf").string();
  const CommandResult result = run_command({"robot", "pairs", robot_, "--srdf", srdf, "--json",
                                            "--write-srdf", out, "--fail-on-refuted"});
  ASSERT_EQ(result.exit_code, 1) << result.err;
  const Json json = Json::parse(result.out);
  EXPECT_EQ(json.at("claimed_never").at("proven"), 1);
  EXPECT_EQ(json.at("claimed_never").at("refuted"), 1);
  const Json& arm_hand = json.at("pairs")[2];
  EXPECT_EQ(arm_hand.at("verdict"), "can");
  EXPECT_NEAR(arm_hand.at("witness").at("slide"), -1, 0.2);
  EXPECT_NE(TemporaryDirectory::read(out).find(R"(link1="base" link2="arm" reason="Never")"),
            std::string::npos);
  const CommandResult text = run_command({"robot", "pairs", robot_, "--srdf", srdf});
  EXPECT_EQ(text.exit_code, 0);
  EXPECT_NE(text.out.find("REFUTED"), std::string::npos) << text.out;
  EXPECT_EQ(run_command({"robot", "pairs", robot_, "--srdf", srdf, "--write-srdf", "-"}).out,
            TemporaryDirectory::read(out));
}

TEST_F(RobotCommand, PairsThatTimeDoesNotReachAreUndecided) {
  const CommandResult result =
      run_command({"robot", "pairs", robot_, "--time-limit", "0", "--json"});
  ASSERT_EQ(result.exit_code, 3) << result.err;
  const Json json = Json::parse(result.out);
  EXPECT_EQ(json.at("undecided"), json.at("pairs").size());
  for (const Json& pair : json.at("pairs")) EXPECT_EQ(pair.at("undecided_share"), 1);
}

TEST_F(RobotCommand, FindsTheFirstImpactOfAPath) {
  // From angle 0 to 2 in time 1: the balls meet where their centres are 0.2 apart.
  const double angle = std::acos(-1.0) / 2 - 2 * std::asin(0.1);
  const CommandResult result = check("p.csv", "time,turn\n0,0\n1,2\n");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  EXPECT_EQ(json.at("toi").at("status"), "Impact");
  EXPECT_EQ(json.at("a"), "arm");
  EXPECT_EQ(json.at("b"), "post");
  EXPECT_NEAR(json.at("free_fraction"), angle / 2, 1e-4);
  EXPECT_LE(json.at("free_fraction"), angle / 2);
  EXPECT_NEAR(json.at("joint_values").at("turn"), angle, 1e-4);
  EXPECT_EQ(check("p.csv", "turn\n0\n2\n", {"--fail-on-impact"}).exit_code, 1);
}

TEST_F(RobotCommand, WritesAPageThatPlaysThePath) {
  const std::string page = (directory_.path() / "p.html").string();
  const CommandResult result = check("p.csv", "time,turn\n0,0\n1,2\n", {"--json", "--page", page});
  if (result.exit_code == 2 && result.err.find("built without its page") != std::string::npos) {
    GTEST_SKIP() << result.err;
  }
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string html = TemporaryDirectory::read(page);
  EXPECT_TRUE(html.starts_with("<!")) << html.substr(0, 80);
  EXPECT_NE(html.find("</html>"), std::string::npos);
  EXPECT_EQ(check("p.csv", "turn\n0\n1\n", {"--page", "/no/such/folder/p.html"}).exit_code, 2);
}

TEST_F(RobotCommand, ProvesAPathFreeAndBoundsItsClearance) {
  // At angle 1 the centres are 2 sin((pi/2 - 1) / 2) apart; the hand is farther away.
  const double gap = 2 * std::sin((std::acos(-1.0) / 2 - 1) / 2) - 0.2;
  const CommandResult result = check("p.json",
                                     R"({"joint_names": ["turn"], "points": [
            {"positions": [0], "time_from_start": {"sec": 0, "nanosec": 0}},
            {"positions": [1], "time_from_start": {"sec": 1, "nanosec": 500000000}}]})",
                                     {"--json", "--clearance"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  EXPECT_EQ(json.at("toi").at("status"), "Separated");
  EXPECT_EQ(json.at("free_fraction"), 1);
  EXPECT_TRUE(json.at("beyond_limits").is_null());
  EXPECT_LE(json.at("clearance").at("lower"), gap);
  EXPECT_GE(json.at("clearance").at("upper"), gap * (1 - 1e-9));
  EXPECT_NEAR(json.at("clearance").at("t"), 1.5, 0.05);
}

TEST_F(RobotCommand, LeavesOutWhatMayTouchAndTellsOfLimits) {
  const CommandResult result =
      check("p.csv", "\xEF\xBB\xBF\"turn\" , slide\n0,0\n\n# a remark\n3,0\n",
            {"--json", "--allow", "arm", "post"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  EXPECT_EQ(json.at("toi").at("status"), "Separated");
  EXPECT_NE(std::string(json.at("beyond_limits")).find("'turn' is at 3"), std::string::npos);
  EXPECT_EQ(check("p.csv", "0 0\n1 0\n", {"--allow", "leg", "post"}).exit_code, 2);
  EXPECT_EQ(check("p.csv", "0 0\n1 0\n", {"--allow", "arm", "moon"}).exit_code, 2);
}

TEST_F(RobotCommand, ReadsPlanningScenesAndTrajectoriesInYaml) {
  // The post of kScene; `slide` rests where the scene says.
  const std::string scene = write("cell.yaml", R"(
robot_state:
  joint_state: {name: [slide], position: [-0.5]}
world:
  collision_objects:
    - id: post
      primitives: [{type: sphere, dimensions: [0.1]}]
      primitive_poses: [{position: [0, 1, 0]}]
)");
  const std::string path = write("p.yaml", R"(joint_names: [turn]
points:
  - positions: [0]
    time_from_start: {sec: 0, nanosec: 0}
  - positions: [2]
    time_from_start: {sec: 1, nanosec: 0}
)");
  const std::vector<std::string> words{"robot", "check", robot_, path, "--scene", scene, "--json"};
  const CommandResult result = run_command(words);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  const double angle = std::acos(-1.0) / 2 - 2 * std::asin(0.1);
  EXPECT_NEAR(json.at("joint_values").at("turn"), angle, 1e-4);
  EXPECT_EQ(json.at("joint_values").at("slide"), -0.5);
  const std::vector<std::string> piped{"robot", "check", robot_, "-", "--scene", scene, "--json"};
  EXPECT_EQ(Json::parse(Command(piped, path).wait().out).at("toi"), json.at("toi"));
  const std::string table = write("p.csv", "time,turn\n0,0\n1,2\n");
  EXPECT_EQ(Json::parse(Command(piped, table).wait().out).at("toi"), json.at("toi"));
  std::vector<std::string> allowed = words;
  allowed.insert(allowed.end(), {"--allow", "arm", "post"});
  EXPECT_EQ(Json::parse(run_command(allowed).out).at("toi").at("status"), "Separated");
  allowed.back() = "moon";
  EXPECT_EQ(run_command(allowed).exit_code, 2);
}

TEST_F(RobotCommand, RefusesPathsItCannotUse) {
  expect_refused("p.csv", "", "at least two waypoints, found 0");
  expect_refused("p.csv", "turn\n0\n", "at least two waypoints, found 1");
  expect_refused("p.csv", "turn,wrist\n0,0\n", "p.csv:1: robot 'r' has no joint 'wrist'");
  expect_refused("p.csv", "turn,copy\n0,0\n", "mimics");
  expect_refused("p.csv", "turn,turn\n0,0\n", "named twice");
  expect_refused("p.csv", "time\n0\n1\n", "name of a joint");
  expect_refused("p.csv", "turn,slide\n0,0\n1,\n", "p.csv:3: expected 2 numbers, found 1");
  expect_refused("p.csv", "turn\n0\nnan\n", "p.csv:3: turn");
  expect_refused("p.csv", "turn\n0\n1e999\n", "p.csv:3: turn");
  expect_refused("p.csv", "turn\n0\n1;2\n", "1;2");
  expect_refused("p.csv", "time,turn\n0,0\n0,1\n", "p.csv:3: expected a time after 0");
  expect_refused("p.csv", "time,turn\n0,0\n1e-320,1e300\n", "p.csv");
  expect_refused("p.json", "[]", "p.json");
  expect_refused("p.json", R"({"joint_names": ["turn"], "points": []})", "points");
  expect_refused("p.json", R"({"joint_names": [1], "points": [{}, {}]})", "joint_names");
  expect_refused("p.json", R"({"joint_names": ["turn"], "points": [
    {"positions": [0]}, {"positions": [0, 1]}]})",
                 "points[1].positions: expected 1 numbers");
  expect_refused("p.json", R"({"joint_names": ["turn"], "points": [
    {"positions": [0], "velocities": [0]}, {"positions": [1]}]})",
                 "velocities");
}

TEST_F(RobotCommand, RefusesWhatIsMissing) {
  EXPECT_EQ(run_command({"robot"}).exit_code, 2);
  EXPECT_EQ(run_command({"robot", "dance", robot_}).exit_code, 2);
  EXPECT_EQ(run_command({"robot", "info", robot_ + "x"}).exit_code, 2);
  EXPECT_EQ(run_command({"robot", "info", robot_, "--base", "wheels"}).exit_code, 2);
  EXPECT_EQ(run_command({"robot", "pairs", robot_, "--max-boxes", "0"}).exit_code, 2);
  EXPECT_EQ(run_command({"robot", "pairs", robot_, "--time-limit", "nan"}).exit_code, 2);
  EXPECT_EQ(run_command({"robot", "pairs", robot_, "--write-srdf", robot_}).exit_code, 2);
  EXPECT_EQ(run_command({"robot", "check", robot_, "no.csv"}).exit_code, 2);
  const CommandResult both = run_command({"robot", "pairs", robot_, "--write-srdf", "-", "--json"});
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_NE(both.err.find("--write-srdf - and --json"), std::string::npos) << both.err;
  const CommandResult urdf = run_command({"robot", "pairs", robot_, "--srdf", robot_});
  EXPECT_EQ(urdf.exit_code, 2);
  EXPECT_NE(urdf.err.find("not an SRDF file"), std::string::npos) << urdf.err;
}

}  // namespace
}  // namespace dyop
