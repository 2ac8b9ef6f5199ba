// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <random>
#include <thread>

#include "dyop/io/file_error.h"
#include "dyop/io/recording.h"
#include "io/record/recorded_world.h"
#include "support/same_bits.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

using testing::has_same_bits;

// A process that records the busy run, and nothing else. It never returns.
pid_t start_recording(const std::filesystem::path& file) {
  const pid_t child = fork();
  if (child != 0) return child;
  try {
    testing::record_busy_run(file);
  } catch (...) {
    _exit(1);
  }
  _exit(0);
}

bool is_made(const std::filesystem::path& file) {
  try {
    const RecordingReader reader(file);
    return true;
  } catch (const FileError&) {
    return false;
  }
}

// What was read is the beginning of the whole run, bit by bit.
void expect_prefix(const RecordingReader& part, const RecordingReader& whole) {
  ASSERT_LE(part.frames().size(), whole.frames().size());
  ASSERT_LE(part.impacts().size(), whole.impacts().size());
  for (std::size_t k = 0; k < part.frames().size(); ++k) {
    ASSERT_EQ(part.frames()[k].interval.end, whole.frames()[k].interval.end);
    ASSERT_EQ(part.frames()[k].kinetic_energy, whole.frames()[k].kinetic_energy);
    ASSERT_EQ(part.pairs(k).size(), whole.pairs(k).size());
    for (std::size_t body = 0; body < part.bodies().size(); ++body) {
      const Scalar t = part.frames()[k].interval.begin;
      ASSERT_TRUE(has_same_bits(part.pose(BodyId(body), t), whole.pose(BodyId(body), t)));
    }
  }
  for (std::size_t k = 0; k < part.impacts().size(); ++k) {
    ASSERT_EQ(part.impacts()[k].t, whole.impacts()[k].t);
    ASSERT_EQ(part.impacts()[k].contacts.size(), whole.impacts()[k].contacts.size());
  }
}

TEST(RecordingOfAKilledRun, IsWholeUpToTheLastFlush) {
  const testing::TemporaryDirectory directory;
  const auto whole_file = directory.path() / "whole.h5";
  const auto begin = std::chrono::steady_clock::now();
  testing::record_busy_run(whole_file);
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - begin;
  const RecordingReader whole(whole_file);
  std::mt19937 random(20);
  std::uniform_real_distribution<double> part(0, 1);
  int not_ended = 0;
  std::size_t frames = 0;
  // On a busy machine some runs end before they are killed, or have no frame yet.
  for (int k = 0; (not_ended < 20 || frames == 0) && k < 200; ++k) {
    const auto file = directory.path() / ("killed" + std::to_string(k) + ".h5");
    const pid_t child = start_recording(file);
    std::this_thread::sleep_for(time * part(random));
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    if (!is_made(file)) continue;  // killed while it made the file, which is no part of the promise
    ASSERT_NO_FATAL_FAILURE({
      const RecordingReader reader(file);
      not_ended += !reader.end().has_value();
      frames += reader.frames().size();
      expect_prefix(reader, whole);
    }) << "kill "
       << k;
  }
  EXPECT_GE(not_ended, 20);
  EXPECT_GT(frames, 0u);
}

}  // namespace
}  // namespace dyop
