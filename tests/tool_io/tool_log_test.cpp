// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/tool_io/tool_log.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "dyop/io/file_error.h"
#include "support/inputs/tool_run_texts.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

namespace fs = std::filesystem;

// Runs the small scene and logs it; the deadline cuts many ticks off.
void log_run(const fs::path& file, bool is_paced, std::int64_t ticks) {
  ToolRun run = parse_tool_run("scene.json", testing::kSmallToolScene);
  run.runner.ticks = ticks;
  run.runner.is_paced = is_paced;
  run.runner.deadline = std::chrono::microseconds(40);
  ToolSession session(run.scene, run.options);
  ToolLogWriter log(file, run);
  run_session(
      session, [&](std::int64_t tick) { return run.device(tick); }, run.tissue,
      [&](const TickRecord& record) { log.add(record); }, run.runner);
  log.close();
  // One hinge, two obstacles.
  EXPECT_LE(log.bytes_of_ticks(), ticks * (130 + 16 + 18 + 16));
}

TEST(ToolLog, AReplayGivesTheSameBits) {
  const testing::TemporaryDirectory directory;
  for (const bool is_paced : {false, true}) {
    const fs::path file = directory.path() / "run.dyoptool";
    log_run(file, is_paced, 600);
    const ToolReplay replay = replay_tool_log(file, "scene.json");
    EXPECT_EQ(replay.ticks, 600);
    EXPECT_EQ(replay.differing, 0) << "first " << replay.first_difference.value_or(-1);
  }
}

TEST(ToolLog, ADamagedLogIsAnError) {
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.dyoptool";
  log_run(file, false, 30);
  fs::resize_file(file, fs::file_size(file) - 5);
  EXPECT_THROW(replay_tool_log(file, "scene.json"), FileError);
  std::ofstream(file) << "something else";
  EXPECT_THROW(replay_tool_log(file, "scene.json"), FileError);
}

// A result that was changed in the file is found.
TEST(ToolLog, AReplayNamesTheFirstDifference) {
  const testing::TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.dyoptool";
  log_run(file, false, 30);
  std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
  bytes.seekp(-3, std::ios::end);
  bytes << '!';
  bytes.close();
  const ToolReplay replay = replay_tool_log(file, "scene.json");
  EXPECT_EQ(replay.differing, 1);
  EXPECT_EQ(replay.first_difference, 29);
}

}  // namespace
}  // namespace dyop
