// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "cli/command.h"
#include "dyop/io/haptic_recording.h"
#include "dyop/io/transform_stream.h"
#include "dyop/view/live_server.h"
#include "dyop/view/run_files.h"
#include "support/inputs/haptic_run_texts.h"
#include "view/browser_check.h"

namespace dyop {
namespace {

using testing::CommandResult;
using testing::run_command;

class ToolCommand : public ::testing::Test {
 protected:
  std::string path(const char* name) const { return (directory_.path() / name).string(); }
  CommandResult run(const std::vector<std::string>& more) const {
    std::vector<std::string> words{
        "tool", directory_.write("scene.json", testing::kSmallHapticScene).string()};
    words.insert(words.end(), more.begin(), more.end());
    return run_command(words);
  }
  testing::TemporaryDirectory directory_;
};

TEST_F(ToolCommand, RecordsARunThatCanBeReadAndReplayed) {
  const CommandResult result = run({"--seconds", "0.5", "-o", path("run.h5")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("down: "), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("recording: 250 bytes a tick"), std::string::npos) << result.out;
  const CommandResult replay = run_command({"tool", path("run.h5"), "--replay"});
  EXPECT_EQ(replay.exit_code, 0) << replay.out << replay.err;
  EXPECT_NE(replay.out.find("500 ticks, 0 different"), std::string::npos) << replay.out;
  const CommandResult words = run_command({"info", path("run.h5")});
  EXPECT_NE(words.out.find("500 in 0.5 s, 250 bytes each"), std::string::npos) << words.out;
  const auto json = nlohmann::json::parse(run_command({"info", path("run.h5"), "--json"}).out);
  EXPECT_EQ(json.at("ticks"), 500);
  EXPECT_TRUE(json.at("is_complete"));
  EXPECT_EQ(json.at("obstacles").at(1).at("name"), "vessel");
  EXPECT_GE(json.at("obstacles").at(1).at("least_clearance"), 2);
}

// Tissue whose snapshots come twice as often as ticks runs at half the session's speed.
TEST_F(ToolCommand, SaysHowFarTissueIsBehind) {
  const std::string text =
      testing::replaced(testing::kSmallHapticScene, R"("rate": 50})", R"("rate": 2000})");
  const std::string scene = directory_.write("scene.json", text).string();
  const CommandResult result =
      run_command({"tool", scene, "--seconds", "0.2", "-o", path("run.h5")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string words = "tissue up to 0.1 s behind the session's time";
  EXPECT_NE(result.out.find(words), std::string::npos) << result.out;
  const CommandResult info = run_command({"info", path("run.h5")});
  EXPECT_NE(info.out.find(words), std::string::npos) << info.out;
  const auto json = nlohmann::json::parse(run_command({"info", path("run.h5"), "--json"}).out);
  EXPECT_NEAR(json.at("tissue_behind").get<Scalar>(), 0.1, 1e-6);
  EXPECT_EQ(run({"--seconds", "0.2"}).out.find("behind the session's time"), std::string::npos);
}

TEST_F(ToolCommand, RunsSeveralTools) {
  const std::string scene =
      directory_.write("two.json", testing::two_tools_haptic_scene()).string();
  const CommandResult result = run_command({"tool", scene, "-o", path("two.h5")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("  tool 2\n"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("to tool 1 (margin 0.1)"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("energy returned to the hands: "), std::string::npos) << result.out;
  const CommandResult replay = run_command({"tool", path("two.h5"), "--replay"});
  EXPECT_EQ(replay.out, "2000 ticks, 0 different\n") << replay.err;
  const CommandResult words = run_command({"info", path("two.h5")});
  EXPECT_NE(words.out.find("    never nearer than"), std::string::npos) << words.out;
  const auto json = nlohmann::json::parse(run_command({"info", path("two.h5"), "--json"}).out);
  EXPECT_EQ(json.at("more_tools").size(), 1u);
  EXPECT_GE(json.at("least_between_tools").at(0), 0.1);
  const CommandResult device = run_command({"tool", scene, "--device", "0"});
  EXPECT_EQ(device.exit_code, 2);
  EXPECT_NE(device.err.find("once for each tool, 2 times, not 1"), std::string::npos) << device.err;
}

TEST_F(ToolCommand, ServesARunThatABrowserFollowsAndStops) {
  if (const std::string why = testing::reason_to_skip_browser(); !why.empty()) GTEST_SKIP() << why;
  if (!has_live_server())
    GTEST_SKIP() << "runs where cpp-httplib is installed: bash .ci/install.sh build";
  const std::string scene = directory_.write("scene.json", testing::kSmallHapticScene).string();
  testing::expect_script_passes("live_tool", "check_live.mjs", {DYOP_COMMAND, scene, "tool"});
}

TEST_F(ToolCommand, ALiveRunIsAnsweredAndRecordedLikeOthers) {
  if (!has_page()) GTEST_SKIP() << "runs where the page is built: bash .ci/install.sh page";
  if (!has_live_server())
    GTEST_SKIP() << "runs where cpp-httplib is installed: bash .ci/install.sh build";
  const CommandResult result =
      run({"--seconds", "0.1", "--live", "--end-with-run", "-o", path("run.h5")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out.find("address: http://127.0.0.1:"), 0u) << result.out;
  EXPECT_NE(result.out.find("100 ticks; "), std::string::npos) << result.out;
  const CommandResult replay = run_command({"tool", path("run.h5"), "--replay"});
  EXPECT_EQ(replay.out, "100 ticks, 0 different\n") << replay.err;
}

// A reader that shares no code with the library.
TEST_F(ToolCommand, ARecordingIsATableInPython) {
  const std::string python = "/usr/bin/python3";
  if (std::system((python + " -c 'import h5py' 2> /dev/null").c_str()) != 0) {
    GTEST_SKIP() << "runs where h5py is installed: bash .ci/install.sh test";
  }
  ASSERT_EQ(run({"--seconds", "0.3", "-o", path("run.h5")}).exit_code, 0);
  const std::string script =
      "import h5py, sys\n"
      "with h5py.File(sys.argv[1], 'r', swmr=True) as run:\n"
      "  t = run['ticks'][:]\n"
      "  print(len(t), repr(float(t['tool_p'][-1, 2])), t['lower'].shape[1])\n";
  const std::string command = python + " " + directory_.write("read.py", script).string() + " " +
                              path("run.h5") + " > " + path("out.txt");
  ASSERT_EQ(std::system(command.c_str()), 0);
  std::istringstream words(testing::TemporaryDirectory::read(path("out.txt")));
  std::size_t ticks = 0, obstacles = 0;
  Scalar height = 0;
  words >> ticks >> height >> obstacles;
  const HapticRecordingReader reader(path("run.h5"));
  EXPECT_EQ(ticks, 300u);
  EXPECT_EQ(obstacles, 2u);
  EXPECT_EQ(height, reader.ticks(299, 1)[0].tool.X_WT.translation().z());
}

// The device of a scene is replaced by messages; the tool's pose and force come back.
class LinkedTool : public ToolCommand {
 protected:
  // One pose out, and what has come back.
  using Exchange = std::function<std::optional<TransformMessage>(const TransformMessage& pose)>;

  // A device that stands still, in a thread of its own, and a tool that must come to it.
  void expect_that_the_tool_follows(const Exchange& exchange, std::vector<std::string> links) {
    const Vector3 place(3, -2, 78);
    std::atomic<bool> is_done{false};
    bool is_answered = false;
    std::thread device([&] {
      while (!is_done) {
        const auto message = exchange({"Device", RigidPose(place)});
        is_answered |= message && (message->name == "Tool" || message->name == "Force");
        std::this_thread::sleep_for(std::chrono::microseconds(300));
      }
    });
    links.insert(links.end(), {"--seconds", "1", "-o", path("run.h5")});
    const CommandResult result = run(links);
    is_done = true;
    device.join();
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(is_answered);
    const HapticRecordingReader reader(path("run.h5"));
    const RecordedTick last = reader.ticks(reader.tick_count() - 1, 1)[0];
    EXPECT_EQ(last.device.p_WD, place);
    EXPECT_LT((last.tool.X_WT.translation() - place).norm(), 0.1);
  }
};

TEST_F(LinkedTool, FollowsADeviceOverUdp) {
  TransformLink receiver(0);
  TransformLink sender(0);
  const std::uint16_t port = TransformLink(0).port();  // free again
  const auto exchange = [&](const TransformMessage& pose) {
    sender.send("127.0.0.1", port, pose);
    return receiver.receive();
  };
  expect_that_the_tool_follows(exchange, {"--device", std::to_string(port), "--send",
                                          "127.0.0.1:" + std::to_string(receiver.port())});
}

TEST_F(LinkedTool, FollowsADeviceOverTcp) {
  TransformStream device(0);
  const auto exchange = [&](const TransformMessage& pose) {
    device.send(pose);
    return device.receive();
  };
  expect_that_the_tool_follows(exchange,
                               {"--device", "tcp:127.0.0.1:" + std::to_string(device.port())});
}

// One over UDP, one over TCP, each of which gets its own tool's answers.
TEST_F(LinkedTool, SeveralFollowADeviceEach) {
  const std::string scene =
      directory_.write("two.json", testing::two_tools_haptic_scene()).string();
  TransformLink sender(0), first(0), second(0);
  TransformStream stream(0);
  const std::uint16_t port = TransformLink(0).port();  // free again
  const Vector3 places[]{{3, -2, 78}, {35, 5, 80}};
  std::atomic<bool> is_done{false};
  std::thread devices([&] {
    while (!is_done) {
      sender.send("127.0.0.1", port, {"Left", RigidPose(places[0])});
      stream.send({"Right", RigidPose(places[1])});
      stream.receive();
      std::this_thread::sleep_for(std::chrono::microseconds(300));
    }
  });
  const auto address = [](const TransformLink& link) {
    return "127.0.0.1:" + std::to_string(link.port());
  };
  const CommandResult result =
      run_command({"tool", scene, "--seconds", "1", "--device", std::to_string(port), "--device",
                   "tcp:127.0.0.1:" + std::to_string(stream.port()), "--send", address(first),
                   "--send", address(second), "-o", path("run.h5")});
  is_done = true;
  devices.join();
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const HapticRecordingReader reader(path("run.h5"));
  const RecordedTick last = reader.ticks(reader.tick_count() - 1, 1)[0];
  EXPECT_EQ(last.device.p_WD, places[0]);
  EXPECT_EQ(last.others.at(0).device.p_WD, places[1]);
  EXPECT_LT((last.others[0].tool.X_WT.translation() - places[1]).norm(), 0.1);
  // What came to the second receiver is the second tool.
  Scalar nearest = kInfinity;
  while (const auto message = second.receive()) {
    if (message->name != "Tool") continue;
    nearest = std::min(nearest, (message->pose.translation() - places[1]).norm());
  }
  EXPECT_LT(nearest, 10);
}

// So short that every tick which has anything to do is cut off; the replay is cut at the same
// places.
TEST_F(ToolCommand, ADeadlineReplacesTheScenes) {
  const CommandResult result =
      run({"--seconds", "0.5", "--deadline", "1e-6", "-o", path("run.h5")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("cut off"), std::string::npos) << result.out;
  const CommandResult replay = run_command({"tool", path("run.h5"), "--replay"});
  EXPECT_EQ(replay.exit_code, 0) << replay.out << replay.err;
}

TEST_F(ToolCommand, RefusesWhatItCannotUse) {
  const auto error_of = [](const CommandResult& result) {
    EXPECT_EQ(result.exit_code, 2);
    return result.err;
  };
  EXPECT_NE(error_of(run({"--send", "nowhere"})).find("ADDRESS:PORT"), std::string::npos);
  EXPECT_NE(error_of(run({"--send", "nowhere:5"})).find("IPv4"), std::string::npos);
  for (const char* device : {"nowhere", "tcp:", "tcp:nowhere", "127.0.0.1:5", "70000", "tcp:a:0"}) {
    EXPECT_NE(error_of(run({"--device", device})).find("tcp:ADDRESS:PORT"), std::string::npos);
  }
  EXPECT_NE(error_of(run({"--device", "tcp:127.0.0.1:1"})).find("127.0.0.1:1"), std::string::npos);
  for (const char* seconds : {"0", "-1", "nan", "inf", "1e300", "soon"}) {
    EXPECT_NE(error_of(run({"--deadline", seconds})).find(seconds), std::string::npos);
    EXPECT_NE(error_of(run({"--seconds", seconds})).find(seconds), std::string::npos);
  }
  EXPECT_NE(error_of(run({"--replay"})).find("scene.json"), std::string::npos);
}

}  // namespace
}  // namespace dyop
