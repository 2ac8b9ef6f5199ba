// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>

#include "cli/command.h"
#include "dyop/view/live_server.h"
#include "dyop/view/run_files.h"
#include "view/browser_check.h"

namespace dyop {
namespace {

using testing::CommandResult;
using testing::run_command;
using testing::TemporaryDirectory;

constexpr const char* kFall = R"({
  "title": "A ball falls",
  "time": {"end": 0.5, "step": 0.01},
  "forces": {"gravity": [0, 0, -9.81]},
  "bodies": [
    {"name": "floor", "kind": "static", "shape": {"box": {"half_extents": [4, 4, 0.5]}},
     "pose": {"position": [0, 0, -0.5]}},
    {"name": "ball", "shape": {"sphere": {"radius": 0.5}}, "density": 1000,
     "pose": {"position": [0, 0, 1.2]}}
  ]
})";

class ViewCommand : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return (directory_.path() / name).string(); }

  // The page of a short run.
  CommandResult view(const std::vector<std::string>& more) const {
    directory_.write("scene.json", kFall);
    const CommandResult run =
        run_command({"simulate", path("scene.json"), "-o", path("run.h5"), "--no-progress"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    std::vector<std::string> words{"view", path("run.h5")};
    words.insert(words.end(), more.begin(), more.end());
    return run_command(words);
  }

  TemporaryDirectory directory_;
};

TEST_F(ViewCommand, WritesThePageOfARecording) {
  if (!has_page()) GTEST_SKIP() << "runs where the page is built: bash .ci/install.sh page";
  const CommandResult result = view({"-o", path("run.html"), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, "{\"page\":\"" + path("run.html") + "\"}\n");
  const std::string page = TemporaryDirectory::read(path("run.html"));
  EXPECT_NE(page.find("<title>A ball falls</title>"), std::string::npos);
  EXPECT_NE(page.find("class=\"block\""), std::string::npos);
}

TEST_F(ViewCommand, SaysWhatIsMissing) {
  const CommandResult result = view({});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find(has_page() ? "-o" : "npm"), std::string::npos) << result.err;
  if (!has_page()) GTEST_SKIP() << "runs where the page is built: bash .ci/install.sh page";
  const CommandResult missing = run_command({"view", path("none.h5"), "-o", path("x.html")});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_NE(missing.err.find("none.h5"), std::string::npos) << missing.err;
  EXPECT_FALSE(std::filesystem::exists(path("x.html")));
}

TEST_F(ViewCommand, DrawsFrames) {
  if (const std::string why = testing::reason_to_skip_browser(); !why.empty()) GTEST_SKIP() << why;
  const CommandResult result = view({"--frames", path("frames"), "--fps", "4", "--width", "320",
                                     "--height", "200", "--browser", DYOP_CHROMIUM});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, "frames: 3\n");
  const std::string first = TemporaryDirectory::read(path("frames/frame-00000.png"));
  const std::string last = TemporaryDirectory::read(path("frames/frame-00002.png"));
  for (const std::string& png : {first, last}) {
    ASSERT_GT(png.size(), 1000u);
    EXPECT_EQ(png.substr(1, 3), "PNG");
    EXPECT_EQ(png.substr(16, 8), std::string("\0\0\1\x40\0\0\0\xC8", 8));  // 320 by 200
  }
  EXPECT_NE(first, last);
}

TEST_F(ViewCommand, ExportsPicturesAndAFilm) {
  if (const std::string why = testing::reason_to_skip_browser(); !why.empty()) GTEST_SKIP() << why;
  ASSERT_EQ(view({"-o", path("run.html")}).exit_code, 0);
  const auto export_to = [&](const char* option, const std::string& out) {
    return run_command({"export", path("run.h5"), option, out, "--fps", "10", "--to", "0.2",
                        "--width", "160", "--height", "100", "--browser", DYOP_CHROMIUM});
  };
  const CommandResult pictures = export_to("--frames", path("frames"));
  ASSERT_EQ(pictures.exit_code, 0) << pictures.err;
  EXPECT_EQ(pictures.out, "frames: 3\n");
  EXPECT_TRUE(std::filesystem::exists(path("frames/frame-00002.png")));
  const CommandResult nothing = run_command({"export", path("run.h5")});
  EXPECT_EQ(nothing.exit_code, 2);
  EXPECT_NE(nothing.err.find("--frames DIR"), std::string::npos) << nothing.err;
  if (!std::filesystem::exists("/usr/bin/ffmpeg"))
    GTEST_SKIP() << "the film is made where ffmpeg is installed: bash .ci/install.sh page";
  const CommandResult film = export_to("-o", path("run.mp4"));
  ASSERT_EQ(film.exit_code, 0) << film.err;
  EXPECT_EQ(TemporaryDirectory::read(path("run.mp4")).substr(4, 4), "ftyp");
}

TEST_F(ViewCommand, RefusesFramesThatCannotBe) {
  if (!has_page()) GTEST_SKIP() << "runs where the page is built: bash .ci/install.sh page";
  const auto expect = [&](const std::vector<std::string>& more, const std::string& part) {
    std::vector<std::string> words{"--frames", path("frames")};
    words.insert(words.end(), more.begin(), more.end());
    const CommandResult result = view(words);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
  };
  expect({"--fps", "0"}, "not 0");
  expect({"--width", "7"}, "not 7");
  expect({"--browser", "/no/browser"}, "/no/browser");
  if (const std::string why = testing::reason_to_skip_browser(); !why.empty()) GTEST_SKIP() << why;
  expect({"--from", "7", "--browser", DYOP_CHROMIUM}, "from 7");
}

TEST_F(ViewCommand, KeepsALiveRunToTheClock) {
  if (!has_page()) GTEST_SKIP() << "runs where the page is built: bash .ci/install.sh page";
  if (!has_live_server())
    GTEST_SKIP() << "runs where cpp-httplib is installed: bash .ci/install.sh build";
  ASSERT_EQ(run_command({"scene", "cradle", "2", "--out", path("scene.json")}).exit_code, 0);
  std::string scene = TemporaryDirectory::read(path("scene.json"));
  const std::string end = "\"end\":10.0";
  ASSERT_NE(scene.find(end), std::string::npos);
  directory_.write("scene.json", scene.replace(scene.find(end), end.size(), "\"end\":0.2"));
  const auto live = [&](const std::string& speed) {
    return run_command(
        {"view", "--live", path("scene.json"), "--end-with-run", "--paced", "--speed", speed});
  };
  const auto begin = std::chrono::steady_clock::now();
  const CommandResult result = live("0.5");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(400));
  for (const char* speed : {"0", "-1", "nan"}) {
    const CommandResult refused = live(speed);
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_NE(refused.err.find(std::string("not ") + speed), std::string::npos) << refused.err;
  }
}

TEST_F(ViewCommand, ServesARunThatABrowserFollowsPausesAndStops) {
  if (const std::string why = testing::reason_to_skip_browser(); !why.empty()) GTEST_SKIP() << why;
  if (!has_live_server())
    GTEST_SKIP() << "runs where cpp-httplib is installed: bash .ci/install.sh build";
  ASSERT_EQ(run_command({"scene", "cradle", "5", "--out", path("scene.json")}).exit_code, 0);
  std::string scene = TemporaryDirectory::read(path("scene.json"));
  const std::string end = "\"end\":10.0";
  ASSERT_NE(scene.find(end), std::string::npos);
  scene.replace(scene.find(end), end.size(), "\"end\":1e6");  // longer than any test
  directory_.write("scene.json", scene);
  testing::expect_script_passes("live", "check_live.mjs", {DYOP_COMMAND, path("scene.json")});
}

}  // namespace
}  // namespace dyop
