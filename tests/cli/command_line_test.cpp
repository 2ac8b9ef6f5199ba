// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/command.h"
#include "support/inputs/cube_files.h"

namespace dyop {
namespace {

using testing::CommandResult;
using testing::run_command;

constexpr int kAnswered = 0;
constexpr int kImpact = 1;
constexpr int kBadInput = 2;
constexpr int kUndecided = 3;

void expect_error(const std::vector<std::string>& arguments, const std::string& part) {
  const CommandResult result = run_command(arguments);
  EXPECT_EQ(result.exit_code, kBadInput) << result.err;
  EXPECT_EQ(result.out, "");
  EXPECT_TRUE(result.err.starts_with("dyop: error: ")) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_NE(result.err.find(part), std::string::npos) << result.err << "has no\n" << part;
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

class CommandLine : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) const {
    return directory_.write(name, text).string();
  }
  std::string out_directory() const { return (directory_.path() / "run").string(); }

  testing::TemporaryDirectory directory_;
};

TEST_F(CommandLine, HelpNamesCommandsAndExitCodes) {
  const CommandResult help = run_command({"--help"});
  EXPECT_EQ(help.exit_code, kAnswered);
  for (const char* part : {"distance", "toi", "ray", "simulate", "info", "paper", "replay",
                           "Exit codes:\n  0  the question was answered", "  1  --fail-on-impact",
                           "  2  bad input", "  3  undecided", "  4  internal error"}) {
    EXPECT_NE(help.out.find(part), std::string::npos) << part << "\nis missing in\n" << help.out;
  }
}

TEST_F(CommandLine, EveryCommandHasTwoExamples) {
  for (const std::string command :
       {"distance", "toi", "ray", "simulate", "info", "paper", "replay"}) {
    const CommandResult help = run_command({command, "--help"});
    EXPECT_EQ(help.exit_code, kAnswered);
    EXPECT_NE(help.out.find("Examples:"), std::string::npos) << help.out;
    EXPECT_GE(count_of(help.out, "\n    dyop " + command + " "), 2u) << help.out;
    EXPECT_NE(help.out.find("--json"), std::string::npos) << help.out;
  }
}

TEST_F(CommandLine, TheCommandsForRobotsHaveExamplesOfTheirOwn) {
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"help", "robot"}, {"help", "robot", "info"}}) {
    const CommandResult help = run_command(words);
    EXPECT_NE(help.out.find("  dyop robot info arm.urdf"), std::string::npos) << help.out;
    EXPECT_EQ(help.out.find("dyop toi"), std::string::npos) << help.out;
  }
}

TEST_F(CommandLine, TellsItsVersion) {
  EXPECT_TRUE(run_command({"--version"}).out.starts_with("dyop "));
}

TEST_F(CommandLine, SuggestsWhatWasMeant) {
  expect_error({"simulat"}, "did you mean 'simulate'? (see dyop --help)");
  expect_error({"dsitance"}, "did you mean 'distance'?");
  expect_error({"robot", "chek"}, "did you mean 'check'? (see dyop robot --help)");
  expect_error({"distance", "sphere:1", "sphere:1", "--max-distanc=3"},
               "did you mean '--max-distance'? (see dyop distance --help)");
  expect_error({"robot", "pairs", "r.urdf", "--max-boxs", "3"}, "did you mean '--max-boxes'?");
  expect_error({"distance", "spher:1", "sphere:1"},
               "there is no such file, and no shape 'spher'; did you mean 'sphere'?");
  expect_error({"distance", "sphere:1", "house:1"}, "no shape 'house'\n");
  const CommandResult result = run_command({"sing"});
  EXPECT_EQ(result.err, "dyop: error: unknown command 'sing' (see dyop --help)\n");
  expect_error({std::string(10'000, 'x')}, "unknown command");
}

TEST_F(CommandLine, HelpIsACommandToo) {
  EXPECT_EQ(run_command({"help"}).out, run_command({"--help"}).out);
  EXPECT_EQ(run_command({"help", "toi"}).out, run_command({"toi", "--help"}).out);
  EXPECT_EQ(run_command({"help", "robot", "check"}).out,
            run_command({"robot", "check", "--help"}).out);
  expect_error({"help", "dance"}, "unknown command 'dance'");
}

TEST_F(CommandLine, ReadsStandardInput) {
  const std::string scene = write("s.json", run_command({"scene", "stack", "2"}).out);
  const CommandResult from_file = run_command({"simulate", scene, "--json"});
  const CommandResult from_input = testing::Command({"simulate", "-", "--json"}, scene).wait();
  ASSERT_EQ(from_input.exit_code, kAnswered) << from_input.err;
  using Json = nlohmann::ordered_json;
  EXPECT_EQ(Json::parse(from_input.out)["bodies"], Json::parse(from_file.out)["bodies"]);
  const std::string bad = write("bad.json", "{");
  EXPECT_NE(testing::Command({"simulate", "-"}, bad).wait().err.find("/dev/stdin:1"),
            std::string::npos);
}

TEST_F(CommandLine, RefusesWhatItDoesNotKnow) {
  expect_error({}, "subcommand");
  expect_error({"dance"}, "dance");
  expect_error({"distance", "sphere:1"}, "B is required");
  expect_error({"distance", "sphere:1", "sphere:1", "--nonsense"}, "--nonsense");
  expect_error({"distance", "sphere:1", "sphere:1", "--position-a", "1", "2"}, "--position-a");
  expect_error({"distance", "sphere:1", "sphere:1", "--position-a", "1", "2", "x"}, "--position-a");
}

TEST_F(CommandLine, RefusesEmptyArguments) {
  expect_error({"distance", "sphere:1", ""}, "sphere:1: an argument is empty (see dyop distance");
  expect_error({"robot", "check", "a", "b", "--scene", ""}, "--scene: an argument is empty");
  expect_error({"robot", "check", "a", "b", "--scene="}, "--scene=: an argument is empty");
  expect_error({"", "sphere:1"}, "an argument is empty");
}

// Balls of radius 0.5 and 1 with centres 3 apart: 1.5.
TEST_F(CommandLine, MeasuresADistance) {
  const CommandResult words =
      run_command({"distance", "sphere:0.5", "sphere:1", "--position-a", "-3", "0", "0"});
  EXPECT_EQ(words.exit_code, kAnswered) << words.err;
  EXPECT_NE(words.out.find("A and B are proven apart."), std::string::npos) << words.out;
  const CommandResult json =
      run_command({"distance", "sphere:0.5", "sphere:1", "--position-a", "-3", "0", "0", "--json"});
  const auto result = nlohmann::json::parse(json.out);
  EXPECT_EQ(result.at("status"), "Separated");
  EXPECT_NEAR(result.at("lower").get<double>(), 1.5, 1e-12);
  EXPECT_NEAR(result.at("upper").get<double>(), 1.5, 1e-12);
  EXPECT_EQ(json.err, "");
}

TEST_F(CommandLine, CastsARay) {
  const std::vector<std::string> ray{
      "ray", "box:1,1,1", "--position-a", "4", "0", "0", "--from", "0",
      "0",   "0",         "--direction",  "2", "0", "0"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), ray.begin(), ray.end());
    return run_command(more);
  };
  const CommandResult words = with({});
  EXPECT_EQ(words.exit_code, kAnswered) << words.err;
  EXPECT_NE(words.out.find("Hit"), std::string::npos) << words.out;
  const auto json = nlohmann::json::parse(with({"--radius", "0.5", "--json"}).out);
  EXPECT_EQ(json.at("status"), "Hit");
  EXPECT_NEAR(json.at("distance").get<double>(), 2.5, 1e-12);
  EXPECT_EQ(with({"--fail-on-impact"}).exit_code, kImpact);
  const auto miss = nlohmann::json::parse(with({"--length", "1", "--json"}).out);
  EXPECT_EQ(miss.at("status"), "Miss");
  EXPECT_EQ(miss.at("distance"), 1);
  EXPECT_TRUE(miss.at("p_WC").is_null());
  expect_error({"ray", "sphere:1", "--from", "0", "0", "0", "--direction", "0", "0", "0"},
               "direction_W");
}

TEST_F(CommandLine, TellsAnOverlapToScriptsThatAsk) {
  EXPECT_EQ(run_command({"distance", "sphere:1", "sphere:1"}).exit_code, kAnswered);
  EXPECT_EQ(run_command({"distance", "sphere:1", "sphere:1", "--fail-on-impact"}).exit_code,
            kImpact);
}

// The cube [0, 1]^3, turned by 45 degrees about z: its nearest edge lies at y = 0, its corner
// (1, 1) at (0, sqrt 2).
TEST_F(CommandLine, PlacesAMesh) {
  const std::string cube = write("cube.obj", testing::cube_obj());
  const CommandResult turned =
      run_command({"distance", cube, "sphere:1", "--axis-angle-a", "0", "0", "1", "45",
                   "--position-b", "0", "4", "0.5", "--json"});
  EXPECT_NEAR(nlohmann::json::parse(turned.out).at("upper").get<double>(), 3 - std::sqrt(2), 1e-9);
  const CommandResult centred =
      run_command({"distance", cube, "sphere:1", "--scale", "2", "--center", "bounds",
                   "--position-b", "4", "0", "0", "--json"});
  EXPECT_NEAR(nlohmann::json::parse(centred.out).at("upper").get<double>(), 2, 1e-9);
}

// Balls of radius 1 at x = -4 and 0, closing at speed 2: they touch at t = 1.
TEST_F(CommandLine, FindsATimeOfImpact) {
  const std::vector<std::string> query{
      "toi", "sphere:1", "sphere:1", "--position-a", "-4", "0", "0", "--velocity-a",
      "2",   "0",        "0",        "--interval",   "0",  "5"};
  const auto with = [&](std::vector<std::string> more) {
    std::vector<std::string> all = query;
    all.insert(all.end(), more.begin(), more.end());
    return run_command(all);
  };
  const CommandResult json = with({"--json"});
  EXPECT_EQ(json.exit_code, kAnswered) << json.err;
  const auto result = nlohmann::json::parse(json.out);
  EXPECT_EQ(result.at("status"), "Impact");
  EXPECT_NEAR(result.at("t_safe").get<double>(), 1, 1e-5);
  EXPECT_NE(with({}).out.find("Impact at t = 0.99999"), std::string::npos) << with({}).out;
  EXPECT_EQ(with({"--fail-on-impact"}).exit_code, kImpact);
  EXPECT_NEAR(
      nlohmann::json::parse(with({"--json", "--target", "0.5"}).out).at("t_safe").get<double>(),
      0.75, 1e-5);
}

// A cube of half extent 1 falls on a plate: its four corners, each of them once.
TEST_F(CommandLine, ListsAllContactsOfAnImpact) {
  const std::vector<std::string> query{
      "toi", "box:5,5,1", "box:1,1,1", "--position-b", "0.3", "0.2", "4",     "--velocity-b",
      "0",   "0",         "-1",        "--interval",   "0",   "9",   "--json"};
  std::vector<std::string> with_contacts = query;
  with_contacts.push_back("--contacts");
  const auto contacts = nlohmann::json::parse(run_command(with_contacts).out).at("contacts");
  int corners = 0;
  for (const auto& contact : contacts) {
    EXPECT_NEAR(contact.at("nhat_AB_W").at(2).get<double>(), 1, 1e-6);
    EXPECT_LE(contact.at("lower").get<double>(), contact.at("upper").get<double>());
    const double x = contact.at("p_WCb").at(0).get<double>() - 0.3;
    const double y = contact.at("p_WCb").at(1).get<double>() - 0.2;
    corners += std::abs(std::abs(x) - 1) < 1e-9 && std::abs(std::abs(y) - 1) < 1e-9;
  }
  EXPECT_EQ(corners, 4);
  EXPECT_TRUE(nlohmann::json::parse(run_command(query).out).at("contacts").empty());
  with_contacts[with_contacts.size() - 2] = "--contacts";  // in words
  with_contacts.pop_back();
  EXPECT_NE(run_command(with_contacts).out.find("from the nearest"), std::string::npos);
}

TEST_F(CommandLine, ProvesThatNothingMeets) {
  const CommandResult result =
      run_command({"toi", "sphere:1", "sphere:1", "--position-a", "-4", "0", "0", "--velocity-a",
                   "-2", "0", "0", "--fail-on-impact", "--json"});
  EXPECT_EQ(result.exit_code, kAnswered);
  EXPECT_EQ(nlohmann::json::parse(result.out).at("status"), "Separated");
}

TEST_F(CommandLine, SaysUndecidedWhenTheBudgetEnds) {
  const std::string cube = write("cube.obj", testing::cube_obj());
  const CommandResult result =
      run_command({"toi", cube, cube, "--position-b", "3", "0.5", "0.25", "--velocity-b", "-4", "0",
                   "0", "--spin-b", "1", "2", "3", "--max-node-pairs", "1", "--json"});
  EXPECT_EQ(result.exit_code, kUndecided) << result.out;
  EXPECT_EQ(nlohmann::json::parse(result.out).at("status"), "BudgetExhausted");
}

TEST_F(CommandLine, AnUndecidedQueryWithoutARecordIsStillUndecided) {
  const std::string cube = write("cube.obj", testing::cube_obj());
  const std::string record = (directory_.path() / "query.json").string();
  const CommandResult result =
      run_command({"toi", cube, cube, "--position-b", "3", "0.5", "0.25", "--velocity-b", "-4", "0",
                   "0", "--spin-b", "1", "2", "3", "--time-limit", "1e-9", "--record", record});
  EXPECT_EQ(result.exit_code, kUndecided) << result.out;
  EXPECT_NE(result.err.find("note: " + record + ": not written"), std::string::npos) << result.err;
  EXPECT_FALSE(std::filesystem::exists(record));
}

TEST_F(CommandLine, ReadsAMotionFile) {
  const std::string motion = write("motion.json", R"({"kind": "interpolated", "interval": [0, 1],
      "from": {"position": [-4, 0, 0]}, "to": {}})");
  const CommandResult result =
      run_command({"toi", "sphere:1", "sphere:1", "--motion-a", motion, "--json"});
  EXPECT_NEAR(nlohmann::json::parse(result.out).at("t_safe").get<double>(), 0.5, 1e-5);
  expect_error({"toi", "sphere:1", "sphere:1", "--motion-a", motion, "--interval", "0", "2"},
               "motion");
  expect_error({"toi", "sphere:1", "sphere:1", "--motion-a", motion, "--spin-a", "1", "0", "0"},
               "--spin-a");
}

TEST_F(CommandLine, TellsWhatAMeshHolds) {
  const std::string cube = write("cube.obj", testing::cube_obj() + "f 1 1 2\nf 3 2 1\n");
  const auto report = nlohmann::json::parse(run_command({"info", cube, "--json"}).out);
  EXPECT_EQ(report.at("triangles"), 14);
  EXPECT_EQ(report.at("vertices"), 8);
  EXPECT_EQ(report.at("degenerate_triangles"), 1);
  EXPECT_EQ(report.at("duplicate_triangles"), 1);
  EXPECT_EQ(report.at("is_closed"), false);
  EXPECT_TRUE(report.at("solid").is_null());

  const std::string whole = write("whole.obj", testing::cube_obj());
  const auto solid =
      nlohmann::json::parse(run_command({"info", whole, "--scale", "2", "--json"}).out);
  EXPECT_EQ(solid.at("is_closed"), true);
  EXPECT_NEAR(solid.at("solid").at("volume").get<double>(), 8, 1e-12);
  EXPECT_NEAR(solid.at("area").get<double>(), 24, 1e-12);
  EXPECT_NE(run_command({"info", whole}).out.find("closed            yes"), std::string::npos);
  expect_error({"info", "sphere:1"}, "expected a mesh file");
}

TEST_F(CommandLine, NamesWhatIsWrongWithAMesh) {
  const auto expect = [&](const std::string& file, const std::string& part) {
    for (const std::string command : {"distance", "toi"}) {
      expect_error({command, file, "sphere:1"}, part);
    }
    expect_error({"info", file}, part);
  };
  expect((directory_.path() / "none.obj").string(), "none.obj: no such file");
  expect(write("empty.obj", ""), "empty.obj: the file is empty");
  expect(write("nan.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n"),
         "nan.obj:2: vertex x: expected a finite number, found 'nan'");
  expect(write("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"),
         "index.obj:4: vertex index 9 is out of range");
  expect(write("short.stl", testing::cube_stl_binary().substr(0, 600)),
         "short.stl: truncated or damaged: the header announces 12 facets, expected 684 bytes, "
         "found 600");
}

TEST_F(CommandLine, NamesWhatIsWrongWithAnOption) {
  expect_error({"toi", "sphere:1", "sphere:1", "--interval", "2", "1"},
               "--interval: time interval must not be reversed: begin 2 > end 1");
  expect_error({"toi", "sphere:1", "sphere:1", "--interval", "0", "nan"}, "--interval");
  expect_error({"distance", "sphere:1", "sphere:1", "--rotation-a", "1", "1", "0", "0"},
               "--rotation-a: pose rotation must be a unit quaternion");
  expect_error({"distance", "sphere:1", "sphere:1", "--position-b", "0", "inf", "0"},
               "--position-b: pose translation must be finite");
  expect_error({"distance", "sphere:-1", "sphere:1"}, "sphere:-1: ");
  expect_error({"distance", "sphere:", "sphere:1"}, "sphere:: expected a number");
  expect_error({"distance", "box:1,2", "sphere:1"}, "box:1,2: expected 3 numbers, found 2");
  expect_error({"distance", "sphere:1", "sphere:1", "--scale", "0", "--max-distance", "-1"}, "-1");
  expect_error({"toi", "sphere:1", "sphere:1", "--tolerance", "0"}, "--tolerance");
  expect_error({"toi", "sphere:1", "sphere:1", "--target", "-1"}, "--target");
  for (const char* option : {"--target", "--tolerance", "--time-limit"}) {
    expect_error({"toi", "sphere:1", "sphere:1", option, "nan"},
                 std::string(option) + ": expected a finite number >");
  }
  expect_error({"toi", "sphere:1", "sphere:1", "--tolerance", "inf"}, "found 'inf'");
  expect_error({"toi", "sphere:1", "sphere:1", "--max-node-pairs", "99999999999999999999"},
               "--max-node-pairs: expected an integer from 1 to 2^63 - 1");
  expect_error({"distance", "sphere:1", "sphere:1", "--axis-angle-a", "0", "0", "0", "90"},
               "--axis-angle-a: the axis must be finite and not zero, not 0 0 0");
  expect_error({"distance", "sphere:1", "sphere:1", "--axis-angle-a", "0", "0", "1", "nan"},
               "--axis-angle-a: the angle must be finite, not nan");
  expect_error({"distance", "sphere:1e61", "sphere:1"},
               "radius must be > 0 and at most 1e+60, not 1e+61");
  expect_error({"info", ""}, "info: an argument is empty");
}

}  // namespace
}  // namespace dyop
