// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "cli/command.h"
#include "dyop/io/recording.h"
#include "dyop/view/run_files.h"

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
                                   "-o", path("run.h5")};
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
  std::filesystem::copy_file(scene, path("scene.h5"));  // a scene may have any name
  unchanged("scene.h5", {"simulate", path("scene.h5"), "-o", path("scene.h5")});
  if (has_page()) {  // without it the command ends before it looks at its files
    unchanged("run.h5", {"view", path("run.h5"), "-o", path("run.h5")});
    unchanged("run.h5", {"view", path("run.h5"), "-o", path("link.h5")});
  }
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
  scene.replace(scene.find("A ball falls"), 12,
                "A \\u001b[31mred\\u009bball\\u0007 \\u202eeslaf\\u2069");
  const CommandResult result =
      run_command({"simulate", directory_.write("red.json", scene).string(), "--no-progress"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(
      result.out.find("A \\x1b[31mred\\xc2\\x9bball\\x07 \\xe2\\x80\\xaeeslaf\\xe2\\x81\\xa9"),
      std::string::npos)
      << result.out;
  for (const char c : result.out) EXPECT_TRUE(c == '\n' || static_cast<unsigned char>(c) >= ' ');
}

TEST_F(RecordingCommands, SimulateRecordsInHdf5) {
  const CommandResult result = simulate({"--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  EXPECT_EQ(json.at("recording"), path("run.h5"));
  const RecordingReader reader(path("run.h5"));
  EXPECT_EQ(reader.interval().end, 1.5);
  ASSERT_EQ(reader.impacts().size(), 1u);
  EXPECT_NEAR(reader.impacts()[0].t, 1, 1e-5);
  // Elastic: at t = 1.5 the ball is where it was at t = 0.5, at 1.5 - t^2 = 1.25.
  EXPECT_NEAR(reader.pose(BodyId(0), 1.5).translation().z(), 1.25, 1e-4);
  EXPECT_NEAR(reader.pose(BodyId(0), 0.3).translation().z(), 1.5 - 0.09, 1e-9);
}

TEST_F(RecordingCommands, SimulateRecordsTheSameForEveryNumberOfThreads) {
  Json scene = Json::parse(kScene);
  scene["bodies"].push_back(Json::parse(R"({"name": "second", "mass": 1,
    "shape": {"box": {"half_extents": [0.3, 0.2, 0.1]}}, "pose": {"position": [0.2, 0.1, 3]},
    "velocity": {"angular": [1, 2, 3]}})"));
  const std::string file = directory_.write("three.json", scene.dump()).string();
  std::string first;
  for (const char* threads : {"1", "2", "0"}) {
    const std::string out = path("threads.h5");
    ASSERT_EQ(run_command({"simulate", file, "-o", out, "--threads", threads}).exit_code, 0);
    const CommandResult text = run_command({"info", out, "--json-lines"});
    if (first.empty()) first = text.out;
    EXPECT_GT(text.out.size(), 1000u);
    EXPECT_EQ(text.out, first);
  }
}

TEST_F(RecordingCommands, SimulateEndsItsFileWhenTheIntegratorGivesUp) {
  Json scene = Json::parse(kScene);  // with a spring whose force overflows
  scene["forces"]["springs"] = {{{"body", "ball"}, {"anchor", {0, 0, -10}}, {"stiffness", 1e308}}};
  const std::string file = directory_.write("spring.json", scene.dump()).string();
  const CommandResult result = run_command({"simulate", file, "-o", path("run.h5")});
  EXPECT_EQ(result.exit_code, 3) << result.err;
  EXPECT_NE(result.out.find("Ended by an error"), std::string::npos) << result.out;
  const RecordingReader reader(path("run.h5"));
  ASSERT_TRUE(reader.end().has_value());
  EXPECT_EQ(result.err, "dyop: error: " + file + ": " + reader.end()->error + "\n");
}

TEST_F(RecordingCommands, SimulateEndsAtASignalWithWhatIsProven) {
  Json scene = Json::parse(kScene);
  scene["time"] = {{"end", 1e6}, {"step", 0.125}};
  const std::string file = directory_.write("long.json", scene.dump()).string();
  const testing::Command command({"simulate", file, "-o", path("run.h5"), "--json"});
  for (int k = 0; k < 500 && !std::filesystem::exists(path("run.h5")); ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  command.send(SIGINT);
  const CommandResult result = command.wait();
  EXPECT_EQ(result.exit_code, 3) << result.err;
  EXPECT_EQ(Json::parse(result.out).at("status"), "Cancelled");
  EXPECT_TRUE(RecordingReader(path("run.h5")).end().has_value());
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

TEST_F(RecordingCommands, InfoWritesAllOfItAsJsonLines) {
  ASSERT_EQ(simulate().exit_code, 0);
  const CommandResult text = run_command({"info", path("run.h5"), "--json-lines"});
  ASSERT_EQ(text.exit_code, 0) << text.err;
  const RecordingReader reader(path("run.h5"));
  std::istringstream lines(text.out);
  std::vector<Json> records;
  for (std::string line; std::getline(lines, line);) records.push_back(Json::parse(line));
  EXPECT_EQ(records.front().at("record"), "header");
  EXPECT_EQ(records.front().at("bodies")[0].at("name"), "ball");
  EXPECT_EQ(records.back().at("record"), "end");
  EXPECT_EQ(records.back().at("status"), "Completed");
  int impacts = 0;
  Scalar t = 0;
  for (const Json& record : records) {
    if (record.at("record") == "impact") {
      ++impacts;
      EXPECT_EQ(record.at("t"), reader.impacts()[0].t);
    }
    if (record.at("record") != "step") continue;
    EXPECT_EQ(record.at("t")[0], t);  // without a gap
    for (std::size_t k = 0; k < 5; ++k) {
      const Scalar time = record.at("t")[k];
      EXPECT_EQ(record.at("states")[k][0][2], reader.pose(BodyId(0), time).translation().z());
    }
    t = record.at("t")[4];
  }
  EXPECT_EQ(impacts, 1);
  EXPECT_EQ(t, 1.5);
}

TEST_F(RecordingCommands, RefuseWhatTheyCannotUse) {
  const auto error_of = [](const std::vector<std::string>& words) {
    const CommandResult result = run_command(words);
    EXPECT_EQ(result.exit_code, 2);
    return result.err;
  };
  EXPECT_NE(error_of({"info", path("none.h5")}).find("no such file"), std::string::npos);
  EXPECT_TRUE(error_of({"check", path("none.h5")}).starts_with("dyop: error: " + path("none.h5")));
  EXPECT_NE(error_of({"info", directory_.write("text.h5", "x").string()})
                .find("not a readable HDF5 file"),
            std::string::npos);
  EXPECT_NE(error_of({"export", path("a.h5"), "-o", path("b.txt")}).find("expected a file .glb"),
            std::string::npos);
  EXPECT_NE(error_of({"simulate", path("scene.json"), "-o", path("run")}).find("ends in .h5"),
            std::string::npos);
  const std::string mesh = directory_.write("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  EXPECT_NE(error_of({"info", mesh, "--json-lines"}).find("needs a recording"), std::string::npos);
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
