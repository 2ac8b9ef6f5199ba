// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "cli/command.h"

namespace dyop {
namespace {

using testing::CommandResult;
using testing::run_command;
using Json = nlohmann::ordered_json;

class Replay : public ::testing::Test {
 protected:
  std::string file() const { return (directory_.path() / "query.json").string(); }

  CommandResult record(std::vector<std::string> more = {}) const {
    std::vector<std::string> words{
        "toi", "sphere:0.5", "box:1,1,1", "--position-a", "-3",  "0", "0", "--velocity-a",
        "4",   "0",          "0",         "--record",     file()};
    words.insert(words.end(), more.begin(), more.end());
    return run_command(words);
  }

  Json written() const { return Json::parse(std::ifstream(file())); }
  void write(const Json& json) const { std::ofstream(file()) << json.dump(); }

  testing::TemporaryDirectory directory_;
};

TEST_F(Replay, FindsARecordedQueryUnchanged) {
  EXPECT_EQ(record().exit_code, 0);
  const CommandResult result = run_command({"replay", file()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("the same as recorded, bit by bit"), std::string::npos) << result.out;
}

TEST_F(Replay, RecordingChangesNothingThatIsPrinted) {
  const Json plain = Json::parse(record({"--json"}).out);
  EXPECT_EQ(plain["status"], "Impact");
}

TEST_F(Replay, NamesTheFieldsThatDiffer) {
  record();
  Json json = written();
  const std::string was = json["result"]["t_safe"];
  json["result"]["t_safe"] = "0x1.8p-1";
  write(json);
  const CommandResult text = run_command({"replay", file()});
  EXPECT_EQ(text.exit_code, 1);
  EXPECT_NE(text.out.find("1 field differs\n  t_safe\n    recorded \"0x1.8p-1\"\n    now      \"" +
                          was + "\"\n"),
            std::string::npos)
      << text.out;
  const Json answer = Json::parse(run_command({"replay", file(), "--json"}).out);
  EXPECT_EQ(answer["same"], false);
  EXPECT_EQ(answer["differences"][0]["field"], "t_safe");
}

TEST_F(Replay, TellsThatAFailureIsGone) {
  record();
  Json json = written();
  json.erase("result");
  json["failure"] = "the impossible happened";
  json["version"] = "0.0.1";
  write(json);
  const CommandResult result = run_command({"replay", file()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.out.find("recorded the impossible happened"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("recorded by dyop 0.0.1, this is "), std::string::npos) << result.out;
}

// What the query refuses now is a failure as well, and the same if it was recorded.
TEST_F(Replay, FindsAFailureUnchanged) {
  record();
  Json json = written();
  json["options"]["distance_tolerance"] = "-0x1p+0";
  json.erase("result");
  json["failure"] = "not this";
  write(json);
  const Json first = Json::parse(run_command({"replay", file(), "--json"}).out);
  json["failure"] = first["differences"][0]["now"];
  write(json);
  EXPECT_EQ(run_command({"replay", file()}).exit_code, 0);
}

TEST_F(Replay, RefusesWhatIsNoRecord) {
  EXPECT_EQ(run_command({"replay", file()}).exit_code, 2);
  write(Json::object());
  const CommandResult result = run_command({"replay", file()});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("dyop_query_record"), std::string::npos) << result.err;
}

TEST_F(Replay, TellsThatARecordCannotBeWritten) {
  const CommandResult result =
      run_command({"toi", "sphere:1", "sphere:1", "--record", "/no/such/folder/query.json"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("could not be written"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace dyop
