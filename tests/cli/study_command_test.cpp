// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <sstream>
#include <thread>

#include "cli/command.h"
#include "io/file_bytes.h"

namespace dyop {
namespace {

using testing::Command;
using testing::CommandResult;
using testing::run_command;
using testing::TemporaryDirectory;
using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

// A ball above a floor; the study sweeps restitution and draws the ball's height.
constexpr const char* kStudyScene = R"({
  "time": {"end": 0.5, "step": 0.05},
  "forces": {"gravity": [0, 0, -9.81]},
  "bodies": [
    {"name": "ball", "shape": {"sphere": {"radius": 0.1}}, "mass": 1,
     "pose": {"position": [0, 0, 1]}, "restitution": 0.5},
    {"name": "floor", "kind": "static", "shape": {"box": {"half_extents": [2, 2, 0.5]}},
     "pose": {"position": [0, 0, -0.5]}}
  ]
})";
constexpr const char* kStudy = R"({
  "scene": "ball.json",
  "sweep": {"/bodies/0/restitution": [0.2, 0.9], "/bodies/0/friction": [0, 1]},
  "random": {"seed": 7, "samples": 5, "values": {"/bodies/0/pose/position/2": [0.5, 1.5]}}
})";

class StudyCommand : public ::testing::Test {
 protected:
  StudyCommand() {
    directory_.write("ball.json", kStudyScene);
    directory_.write("study.json", kStudy);
  }
  std::string at(const std::string& name) const { return (directory_.path() / name).string(); }
  CommandResult study(const std::vector<std::string>& more, const std::string& out = "out") const {
    std::vector<std::string> words{"study", at("study.json"), "--out", at(out), "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return run_command(words);
  }
  std::string read(const std::string& name) const {
    return TemporaryDirectory::read(directory_.path() / name);
  }
  TemporaryDirectory directory_;
};

std::vector<Json> lines_of(const std::string& text) {
  std::istringstream in(text);
  std::vector<Json> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(Json::parse(line));
  return lines;
}

TEST_F(StudyCommand, RunsEveryCaseOnceWhateverTheShards) {
  ASSERT_EQ(study({}).exit_code, 0);
  ASSERT_EQ(study({"--merge"}).exit_code, 0);
  for (int k = 3; k >= 1; --k) {
    const CommandResult part = study({"--shard", std::to_string(k) + "/3"}, "parts");
    EXPECT_EQ(part.exit_code, 0) << part.err;
    EXPECT_EQ(Json::parse(part.out).at("run"), k == 3 ? 6 : 7);
  }
  ASSERT_EQ(study({"--merge"}, "parts").exit_code, 0);
  const std::string results = read("out/results.jsonl");
  EXPECT_EQ(read("parts/results.jsonl"), results);
  const std::vector<Json> lines = lines_of(results);
  ASSERT_EQ(lines.size(), 20u);
  for (std::size_t i = 0; i < lines.size(); ++i) EXPECT_EQ(lines[i].at("case"), i);
}

TEST_F(StudyCommand, SweepsAndDrawsWhatItSays) {
  ASSERT_EQ(study({}).exit_code, 0);
  std::set<std::pair<double, double>> combinations;
  std::set<double> heights;
  std::vector<Json> lines = lines_of(read("out/shard-1-of-1.jsonl"));
  ASSERT_EQ(lines.size(), 21u);
  lines.erase(lines.begin());  // the header
  for (const Json& line : lines) {
    const Json& values = line.at("values");
    combinations.emplace(values.at("/bodies/0/restitution"), values.at("/bodies/0/friction"));
    const double height = values.at("/bodies/0/pose/position/2");
    EXPECT_TRUE(0.5 <= height && height < 1.5);
    heights.insert(height);
    // Where the ball is met follows from its height: free fall to the floor.
    const double fall = std::sqrt(2 * (height - 0.1) / 9.81);
    if (fall < 0.5) {
      EXPECT_NEAR(line.at("first_impact").get<double>(), fall, 1e-3);
    } else {
      EXPECT_TRUE(line.at("first_impact").is_null());
    }
    EXPECT_EQ(line.at("status"), "Completed");
    EXPECT_EQ(line.at("steps"), 10);
    EXPECT_EQ(line.at("bodies").size(), 2u);
  }
  EXPECT_EQ(combinations.size(), 4u);
  EXPECT_EQ(heights.size(), 20u);
}

TEST_F(StudyCommand, GoesOnAfterAKillWithTheSameBytes) {
  directory_.write("ball.json", std::string(kStudyScene)
                                    .replace(std::string(kStudyScene).find("0.5, \"step\": 0.05"),
                                             17, "50, \"step\": 0.001"));
  ASSERT_EQ(study({}, "whole").exit_code, 0);
  const std::string whole = read("whole/shard-1-of-1.jsonl");
  const Command killed({"study", at("study.json"), "--out", at("out")});
  for (int i = 0; i < 500 && lines_of(read("out/shard-1-of-1.jsonl")).size() < 3; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  killed.send(SIGKILL);
  EXPECT_EQ(killed.wait().exit_code, -1);
  const std::string found = read("out/shard-1-of-1.jsonl");
  EXPECT_LT(found.size(), whole.size());
  // As if it had been killed within a line.
  directory_.write("out/shard-1-of-1.jsonl", whole.substr(0, found.size() + 40));
  const CommandResult rest = study({});
  EXPECT_EQ(rest.exit_code, 0) << rest.err;
  EXPECT_GE(Json::parse(rest.out).at("found"), 2);
  EXPECT_EQ(read("out/shard-1-of-1.jsonl"), whole);
  EXPECT_EQ(Json::parse(study({}).out).at("run"), 0);
  EXPECT_EQ(read("out/shard-1-of-1.jsonl"), whole);
}

TEST_F(StudyCommand, NamesWhatIsMissing) {
  ASSERT_EQ(study({"--shard", "1/4"}).exit_code, 0);
  const CommandResult merge = study({"--merge"});
  EXPECT_EQ(merge.exit_code, 3);
  EXPECT_EQ(Json::parse(merge.out).at("missing"), 15);
  EXPECT_EQ(Json::parse(merge.out).at("first_missing"), 1);
  EXPECT_FALSE(fs::exists(directory_.path() / "out/results.jsonl"));
}

// The lines of a shard with the digests that their present texts have.
std::string with_digests_of_its_own(const std::string& text) {
  std::string sealed;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::string key = ",\"digest\":\"";
    line = line.substr(0, line.rfind(key)) + "}";
    const std::string digest = io_internal::hex_digits(io_internal::digest_of(line));
    sealed += line.substr(0, line.size() - 1) + key + digest + "\"}\n";
  }
  return sealed;
}

TEST_F(StudyCommand, FindsAnyChangedLetterOfAResult) {
  ASSERT_EQ(study({"--shard", "1/2"}).exit_code, 0);
  const std::string whole = read("out/shard-1-of-2.jsonl");
  std::mt19937_64 random(20261123);
  for (int k = 0; k < 20; ++k) {
    std::string changed = whole;
    char& letter = changed[random() % whole.size()];
    if (letter == '\n') continue;  // a cut line is run again
    letter = char(letter ^ 1);
    if (letter == '\n') continue;
    directory_.write("out/shard-1-of-2.jsonl", changed);
    EXPECT_EQ(study({"--merge"}).exit_code, 2) << changed;
  }
}

TEST_F(StudyCommand, RefusesResultsOfAnotherStudyAndContradictions) {
  ASSERT_EQ(study({"--shard", "1/2"}).exit_code, 0);
  std::string changed = read("out/shard-1-of-2.jsonl");
  const std::size_t place = changed.find("\"impacts\":");
  changed.replace(place, 11, "\"impacts\":9");
  directory_.write("out/shard-1-of-1.jsonl", changed);
  const CommandResult damaged = study({"--merge"});
  EXPECT_EQ(damaged.exit_code, 2);
  EXPECT_NE(damaged.err.find("damaged line"), std::string::npos) << damaged.err;
  directory_.write("out/shard-1-of-1.jsonl", with_digests_of_its_own(changed));
  const CommandResult merge = study({"--merge"});
  EXPECT_EQ(merge.exit_code, 2);
  EXPECT_NE(merge.err.find("another result for case 0"), std::string::npos) << merge.err;
  EXPECT_EQ(study({}).exit_code, 2);  // case 2 where case 1 should be
  directory_.write("study.json", R"({"scene": "ball.json"})");
  const CommandResult other = study({"--shard", "1/2"});
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_NE(other.err.find("another study"), std::string::npos) << other.err;
}

TEST_F(StudyCommand, RecordsACaseThatCannotBeRun) {
  directory_.write("study.json",
                   R"({"scene": "ball.json", "sweep": {"/bodies/0/restitution": [0.5, 7]}})");
  const CommandResult shard = study({});
  ASSERT_EQ(shard.exit_code, 0);
  const CommandResult merge = study({"--merge"});
  EXPECT_EQ(Json::parse(merge.out).at("ends"), Json::parse(R"({"Completed": 1, "Error": 1})"));
  for (const Json& report : {Json::parse(shard.out), Json::parse(merge.out)}) {
    EXPECT_EQ(report.at("errors"), 1);
    EXPECT_NE(report.at("first_error").get<std::string>().find("restitution"), std::string::npos);
  }
  const std::string error = lines_of(read("out/results.jsonl"))[1].at("error");
  EXPECT_NE(error.find("restitution"), std::string::npos) << error;
  EXPECT_EQ(error.find(".case-"), std::string::npos) << error;
}

TEST_F(StudyCommand, RefusesAStudyThatMakesNoSense) {
  const auto expect = [&](const std::string& text, const std::string& part) {
    directory_.write("study.json", text);
    const CommandResult result = study({});
    EXPECT_EQ(result.exit_code, 2) << text;
    EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
  };
  expect("{", "not JSON");
  expect("{}", "/scene");
  expect(R"({"scene": "none.json"})", "none.json");
  expect(R"({"scene": "ball.json", "swep": {}})", "swep");
  expect(R"({"scene": "ball.json", "sweep": {"/bodies/0/mass": []}})", "list of values");
  expect(R"({"scene": "ball.json", "sweep": {"/bodies/9/mass": [1]}})", "points at nothing");
  expect(R"({"scene": "ball.json", "sweep": {"mass": [1]}})", "not a JSON pointer");
  expect(R"({"scene": "ball.json", "random": {"samples": 0, "values": {}}})", "samples");
  expect(R"({"scene": "ball.json", "random": {"samples": 2, "values": {"/time/end": [2, 1]}}})",
         "[low, high]");
  directory_.write("study.json", kStudy);
  for (const char* shard : {"0/3", "4/3", "1", "a/b", "1/"}) {
    EXPECT_EQ(study({"--shard", shard}).exit_code, 2) << shard;
  }
  EXPECT_EQ(study({"--shard", "1/2", "--merge"}).exit_code, 2);
}

}  // namespace
}  // namespace dyop
