// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "cli/command.h"
#include "dyop/io/recording_reader.h"

namespace dyop {
namespace {

using testing::CommandResult;
using testing::run_command;
using Json = nlohmann::ordered_json;

// A ball that bounces once, and a box that rests.
constexpr const char* kScene = R"({
  "title": "A ball falls on a box",
  "time": {"end": 1.5, "step": 0.125}, "target_distance": 1e-7, "rest_offset": 1e-6,
  "bodies": [
    {"name": "ball", "shape": {"sphere": {"radius": 0.5}}, "density": 1,
     "pose": {"position": [0, 0, 1.5]}, "restitution": 1, "friction": 0},
    {"name": "box", "kind": "static", "shape": {"box": {"half_extents": [5, 5, 1]}},
     "pose": {"position": [0, 0, -1]}, "restitution": 1}
  ],
  "forces": {"gravity": [0, 0, -2]}})";

class RecordingCommands : public ::testing::Test {
 protected:
  std::string path(const char* name) const { return (directory_.path() / name).string(); }
  CommandResult simulate(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words{"simulate", directory_.write("scene.json", kScene).string(),
                                   "--record", path("run.h5")};
    words.insert(words.end(), more.begin(), more.end());
    return run_command(words);
  }
  testing::TemporaryDirectory directory_;
};

TEST_F(RecordingCommands, NeverWriteOverTheirInput) {
  ASSERT_EQ(simulate().exit_code, 0);
  const std::string scene = path("scene.json");
  std::filesystem::create_symlink("run.h5", path("link.h5"));
  const auto unchanged = [&](const char* name, const std::vector<std::string>& words) {
    const std::string before = testing::TemporaryDirectory::read(path(name));
    const CommandResult result = run_command(words);
    EXPECT_EQ(result.exit_code, 2) << words[0];
    EXPECT_NE(result.err.find("is read by this command"), std::string::npos) << result.err;
    EXPECT_EQ(testing::TemporaryDirectory::read(path(name)), before) << words[0];
  };
  unchanged("scene.json", {"simulate", scene, "--record", scene});
  unchanged("run.h5", {"view", path("run.h5"), "-o", path("run.h5")});
  unchanged("run.h5", {"view", path("run.h5"), "-o", path("link.h5")});
  unchanged("run.h5", {"export", path("run.h5"), "-o", path("link.h5")});
  directory_.write("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  unchanged("a.off", {"toi", path("a.off"), "sphere:1", "--record", path("a.off")});
}

TEST_F(RecordingCommands, RecordOverNothingButRecordings) {
  ASSERT_EQ(simulate().exit_code, 0);
  ASSERT_EQ(simulate().exit_code, 0);
  directory_.write("run.h5", "a letter");
  const CommandResult result = simulate();
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("is not a recording, so it is not replaced"), std::string::npos);
  EXPECT_EQ(testing::TemporaryDirectory::read(path("run.h5")), "a letter");
}

TEST_F(RecordingCommands, NamesCannotSteerTheTerminal) {
  std::string scene = kScene;
  scene.replace(scene.find("A ball falls"), 12, "A \\u001b[31mred\\u009bball\\u0007");
  const CommandResult result =
      run_command({"simulate", directory_.write("red.json", scene).string(), "--no-progress"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("A \\x1b[31mred\\xc2\\x9bball\\x07"), std::string::npos) << result.out;
  for (const char c : result.out) EXPECT_TRUE(c == '\n' || static_cast<unsigned char>(c) >= ' ');
}

TEST_F(RecordingCommands, SimulateRecordsInHdf5) {
  const CommandResult result = simulate({"--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  EXPECT_EQ(json.at("recording"), path("run.h5"));
  EXPECT_TRUE(json.at("summary").is_null());
  const RecordingReader reader(path("run.h5"));
  EXPECT_EQ(reader.interval().end, 1.5);
  ASSERT_EQ(reader.impacts().size(), 1u);
  EXPECT_NEAR(reader.impacts()[0].t, 1, 1e-5);
  // Elastic: at t = 1.5 the ball is where it was at t = 0.5, at 1.5 - t^2 = 1.25.
  EXPECT_NEAR(reader.pose(BodyId(0), 1.5).translation().z(), 1.25, 1e-4);
  EXPECT_NEAR(reader.pose(BodyId(0), 0.3).translation().z(), 1.5 - 0.09, 1e-9);
}

TEST_F(RecordingCommands, SimulateWritesTheSummaryBesideIt) {
  const CommandResult result = simulate({"--out", path("run")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(testing::TemporaryDirectory::read(path("run") + "/summary.txt"), result.out);
  EXPECT_FALSE(std::filesystem::exists(path("run") + "/recording.jsonl"));
}

TEST_F(RecordingCommands, InfoTellsWhatHappened) {
  ASSERT_EQ(simulate().exit_code, 0);
  const CommandResult text = run_command({"info", path("run.h5")});
  ASSERT_EQ(text.exit_code, 0) << text.err;
  EXPECT_NE(text.out.find("ended             Completed"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("impacts           1\n"), std::string::npos) << text.out;
  const CommandResult json_text = run_command({"info", path("run.h5"), "--json"});
  const Json json = Json::parse(json_text.out);
  EXPECT_EQ(json.at("bodies"), 2);
  EXPECT_EQ(json.at("is_complete"), true);
  EXPECT_EQ(json.at("segments").at("rest"), 1);
  EXPECT_EQ(json.at("frames"), 12);
}

TEST_F(RecordingCommands, ExportConvertsARecordingAsText) {
  const std::string scene = directory_.write("scene.json", kScene).string();
  ASSERT_EQ(run_command({"simulate", scene, "--out", path("run")}).exit_code, 0);
  const CommandResult result = run_command(
      {"export", path("run") + "/recording.jsonl", "--scene", scene, "-o", path("converted.h5")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  ASSERT_EQ(simulate().exit_code, 0);
  const RecordingReader converted(path("converted.h5"));
  const RecordingReader exact(path("run.h5"));
  for (int k = 0; k < 100; ++k) {
    const Scalar t = 1.5 * k / 100;
    EXPECT_NEAR(converted.pose(BodyId(0), t).translation().z(),
                exact.pose(BodyId(0), t).translation().z(), 1e-12);
  }
}

TEST_F(RecordingCommands, RefuseWhatTheyCannotUse) {
  const auto error_of = [](const std::vector<std::string>& words) {
    const CommandResult result = run_command(words);
    EXPECT_EQ(result.exit_code, 2);
    return result.err;
  };
  EXPECT_NE(error_of({"info", path("none.h5")}).find("no such file"), std::string::npos);
  EXPECT_NE(error_of({"info", directory_.write("text.h5", "x").string()})
                .find("not a readable HDF5 file"),
            std::string::npos);
  EXPECT_NE(error_of({"export", path("a.jsonl"), "-o", path("b.h5")}).find("--scene"),
            std::string::npos);
}

// The reader of examples/recording, which shares no code with the library.
TEST_F(RecordingCommands, AnswerAsAReaderInPythonDoes) {
  const std::string python = "/usr/bin/python3";
  if (std::system((python + " -c 'import h5py' 2> /dev/null").c_str()) != 0) {
    GTEST_SKIP() << "runs where h5py is installed: bash .ci/install.sh test";
  }
  ASSERT_EQ(simulate().exit_code, 0);
  const std::string command = python + " " DYOP_READ_RECORDING " " + path("run.h5") +
                              " 0 0.3 0.99 1.4999 > " + path("poses.txt");
  ASSERT_EQ(std::system(command.c_str()), 0);
  std::ifstream poses(path("poses.txt"));
  std::string line;
  std::getline(poses, line);
  EXPECT_NE(line.find("2 bodies"), std::string::npos) << line;
  EXPECT_NE(line.find("1 impacts"), std::string::npos) << line;
  const RecordingReader reader(path("run.h5"));
  int count = 0;
  for (; std::getline(poses, line); ++count) {
    const Json json = Json::parse(line);
    const BodyId body(json.at("body") == "ball" ? 0 : 1);
    const RigidPose X_WB = reader.pose(body, json.at("t").get<Scalar>());
    for (std::size_t k = 0; k < 9; ++k) {
      EXPECT_NEAR(json.at("R")[k].get<Scalar>(),
                  X_WB.rotation()(Eigen::Index(k / 3), Eigen::Index(k % 3)), 1e-14);
    }
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(json.at("p")[k].get<Scalar>(), X_WB.translation()[Eigen::Index(k)], 1e-14);
    }
  }
  EXPECT_EQ(count, 8);
}

}  // namespace
}  // namespace dyop
