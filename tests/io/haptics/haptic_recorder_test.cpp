// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/haptic_recorder.h"

#include <gtest/gtest.h>

#include <thread>

#include "dyop/core/error.h"
#include "dyop/io/file_error.h"
#include "dyop/io/haptic_replay.h"
#include "support/inputs/mixed_session.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

namespace fs = std::filesystem;

class HapticRecorderFile : public ::testing::Test {
 protected:
  fs::path file() const { return directory_.path() / "run.h5"; }

 private:
  testing::TemporaryDirectory directory_;
};

// More ticks than may wait.
TEST_F(HapticRecorderFile, HasEverythingThatASessionWasGiven) {
  constexpr int kTicks = 5000;
  HapticSession session(testing::mixed_scene(2), testing::haptic_options());
  const auto recorder = record_session(session, file(), {"mixed", "", 1e-3, ""});
  testing::TissueGiver giver(session, 5);
  testing::HandsAtRandom hands(session, 5);
  std::jthread tissue([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      giver.give();
      std::this_thread::sleep_for(std::chrono::microseconds(500));
    }
  });
  for (int k = 0; k < kTicks; ++k) hands.tick(k);
  tissue.request_stop();
  tissue.join();
  recorder->finish();
  EXPECT_EQ(recorder->unlogged(), 0);
  const HapticReplay replay = replay_haptic_recording(file());
  EXPECT_EQ(replay.ticks, kTicks);
  EXPECT_EQ(replay.differing, 0) << "first " << replay.first_difference.value_or(-1);
  const HapticRecordingReader reader(file());
  EXPECT_EQ(reader.header().title, "mixed");
  EXPECT_EQ(reader.end()->ticks, kTicks);
}

TEST_F(HapticRecorderFile, IsLeftAloneByASessionThatHasRunOrIsRecorded) {
  const auto is_refused = [&](HapticSession& session) {
    try {
      record_session(session, file());
    } catch (const InvalidArgument&) {
      return !fs::exists(file());
    }
    return false;
  };
  HapticSession late(testing::heaving_scene(), testing::haptic_options());
  late.update(testing::heaving_device(0), 1e-3);
  EXPECT_TRUE(is_refused(late));
  HapticSession twice(testing::heaving_scene(), testing::haptic_options());
  const auto recorder = record_session(twice, file().parent_path() / "first.h5");
  EXPECT_TRUE(is_refused(twice));
}

TEST_F(HapticRecorderFile, EndsOnceAndSaysWhy) {
  HapticSession session(testing::heaving_scene(), testing::haptic_options());
  EXPECT_THROW(record_session(session, file() / "none" / "run.h5"), FileError);
  const auto recorder = record_session(session, file());
  for (int k = 0; k < 7; ++k) session.update(testing::heaving_device(k), 1e-3);
  recorder->fail("the device is gone");
  session.update(testing::heaving_device(7), 1e-3);
  EXPECT_THROW(recorder->finish(), InvalidArgument);
  const HapticRecordingReader reader(file());
  EXPECT_EQ(reader.tick_count(), 7);
  EXPECT_EQ(reader.end()->error, "the device is gone");
}

// 70 to 90 bytes for a turn, 150 for a place, 400 for springs.
TEST_F(HapticRecorderFile, GrowsByFewBytesAnInput) {
  const auto size_with = [&](int inputs) {
    HapticSession session(testing::heaving_scene(), testing::haptic_options());
    const auto recorder = record_session(session, file());
    for (int k = 0; k < 3000; ++k) {
      if (k < inputs) session.set_coupling(testing::haptic_options().coupling);
      session.update(testing::heaving_device(0), 1e-3);
    }
    recorder->finish();
    return Scalar(fs::file_size(file()));
  };
  EXPECT_LT((size_with(2500) - size_with(500)) / 2000, 450);
}

}  // namespace
}  // namespace dyop
