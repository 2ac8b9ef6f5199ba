// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "cli/command.h"

namespace dyop {
namespace {

using testing::CommandResult;
using testing::run_command;
using Json = nlohmann::ordered_json;

class SceneCommand : public ::testing::Test {
 protected:
  std::string file() const { return (directory_.path() / "scene.json").string(); }

  testing::TemporaryDirectory directory_;
};

TEST_F(SceneCommand, WritesASceneThatRuns) {
  ASSERT_EQ(run_command({"scene", "stack", "2", "--out", file()}).exit_code, 0);
  const CommandResult run = run_command({"simulate", file(), "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(Json::parse(run.out).at("bodies").size(), 3u);
}

TEST_F(SceneCommand, PrintsASceneWithoutMeshes) {
  ASSERT_EQ(run_command({"scene", "stack", "2", "--out", file()}).exit_code, 0);
  const CommandResult printed = run_command({"scene", "stack", "2"});
  ASSERT_EQ(printed.exit_code, 0) << printed.err;
  EXPECT_EQ(printed.out, testing::TemporaryDirectory::read(file()));
}

TEST_F(SceneCommand, NamesTheMeshesItWrote) {
  const CommandResult result = run_command({"scene", "gears", "2", "--out", file(), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(Json::parse(result.out).at("meshes"), Json({"gear.obj"}));
  EXPECT_TRUE(std::filesystem::exists(directory_.path() / "gear.obj"));
}

TEST_F(SceneCommand, RefusesWhatItCannotMake) {
  const auto expect = [&](const std::vector<std::string>& arguments, const std::string& part) {
    const CommandResult result = run_command(arguments);
    EXPECT_EQ(result.exit_code, 2) << part;
    EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
    EXPECT_FALSE(std::filesystem::exists(file()));
  };
  expect({"scene", "heap", "2", "--out", file()}, "'heap'");
  expect({"scene", "stack", "0", "--out", file()}, "not 0");
  expect({"scene", "stack", "many", "--out", file()}, "many");
  expect({"scene", "gears", "2"}, "--out is required: mesh files");
  expect({"scene", "stack", "2", "--json"}, "--out is required with --json");
  expect({"scene", "arch", "5", "--out", file() + "/none/s.json"}, "could not be written");
}

}  // namespace
}  // namespace dyop
