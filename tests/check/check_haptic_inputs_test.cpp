// SPDX-License-Identifier: BSD-3-Clause

// Sessions that were given everything at random: a recording has all of it, so that the replay has
// the same bits and dyop-check proves the run.

#include <gtest/gtest.h>

#include <thread>

#include "dyop/io/file_error.h"
#include "dyop/io/haptic_replay.h"
#include "io/record/hdf5_file.h"
#include "support/check_answer.h"
#include "support/inputs/mixed_session.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

namespace fs = std::filesystem;

using testing::HandsAtRandom;
using testing::TissueGiver;

class CheckHapticInputs : public ::testing::Test {
 protected:
  fs::path file() const { return directory_.path() / "run.h5"; }

  struct Totals {
    int early = 0;    // turns before the end of a motion
    int waiting = 0;  // of them those that stand without a next snapshot
    int resumed = 0;  // that were given up
    int resets = 0;
    int couplings = 0;
    int meshes = 0;
  };

  // The run has the same bits again, and is proven.
  void expect_complete() {
    const HapticReplay replay =
        replay_haptic_recording(file(), [&](const RecordedTick& tick, const HapticTick&) {
          for (const RecordedInput& input : tick.inputs) {
            const auto* turn = std::get_if<RecordedTurn>(&input);
            if (!turn) continue;
            totals_.early += turn->from < 1;
            totals_.waiting += turn->from < 1 && !turn->is_given;
            totals_.resumed += turn->from == 1 && !turn->is_given;
          }
        });
    ASSERT_EQ(replay.differing, 0) << "first " << replay.first_difference.value_or(-1);
    const testing::Answer answer = testing::check(file());
    ASSERT_EQ(answer.code, testing::kProven) << answer.text << answer.error;
  }

  // Changes the text of the inputs; without the digests, which would tell of it.
  void edit_inputs(const std::function<void(std::string&)>& edit) const {
    const auto checked = [](auto result) {
      EXPECT_GE(result, 0);
      return result;
    };
    const io_internal::Hdf5Handle opened(H5Fopen(file().c_str(), H5F_ACC_RDWR, H5P_DEFAULT),
                                         &H5Fclose);
    checked(H5Ldelete(opened.get(), "digests", H5P_DEFAULT));
    const io_internal::Hdf5Handle rows(H5Dopen2(opened.get(), "inputs", H5P_DEFAULT), &H5Dclose);
    std::string text(std::size_t(H5Dget_storage_size(rows.get())), '\0');
    checked(H5Dread(rows.get(), H5T_NATIVE_UINT8, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data()));
    text.resize(text.find_last_of('\n') + 1);
    edit(text);
    const hsize_t size = text.size();
    checked(H5Dset_extent(rows.get(), &size));
    checked(H5Dwrite(rows.get(), H5T_NATIVE_UINT8, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data()));
  }

  // A sheet that is sent elsewhere in the middle of its way.
  void record_turn() const {
    HapticScene scene = testing::ball_tool(2, {0, 0, 6});
    scene.obstacles.push_back(testing::deforming_tissue(testing::sheet(30, 8)));
    HapticSession session(scene, testing::haptic_options());
    HapticRecordingWriter writer(file(), {}, session);
    const auto raised = [&](Scalar z) {
      std::vector<Vector3> vertices = scene.obstacles[0].vertices;
      for (Vector3& p : vertices) p.z() += z;
      return vertices;
    };
    for (int k = 0; k < 60; ++k) {
      if (k == 3) session.give_snapshot(0, raised(2), 0.02);
      if (k == 9) session.retarget(0, raised(-2), 0.02);
      TickRecord record{k, testing::device_at({0, 0, 6}), 1e-3, {}};
      record.tick = session.update(record.device, record.dt);
      writer.add(record);
    }
    writer.finish({});
  }

  // Softer springs, or the tool elsewhere.
  void record_change(bool is_reset) const {
    HapticSession session(testing::heaving_scene(), testing::haptic_options());
    HapticRecordingWriter writer(file(), {}, session);
    CouplingOptions springs = testing::haptic_options().coupling;
    springs.stiffness /= 2;
    for (int k = 0; k < 60; ++k) {
      if (k == 30 && is_reset) session.reset({RigidPose(Vector3(0, 0, 5)), {}});
      if (k == 30 && !is_reset) session.set_coupling(springs);
      TickRecord record{k, testing::device_at({0.3, 0.2, 4 - 0.1 * k}), 1e-3, {}};
      record.tick = session.update(record.device, record.dt);
      writer.add(record);
    }
    writer.finish({});
  }

  // Refused or different, not the same bits.
  bool is_replayed() const {
    try {
      return replay_haptic_recording(file()).differing == 0;
    } catch (const FileError&) {
      return false;
    }
  }

  void count(const HandsAtRandom& hands, const TissueGiver& giver) {
    totals_.resets += hands.resets();
    totals_.couplings += hands.couplings();
    totals_.meshes += giver.meshes();
  }

  Totals totals_;

 private:
  testing::TemporaryDirectory directory_;
};

TEST_F(CheckHapticInputs, AreAllInTheFileInOneThread) {
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    SCOPED_TRACE(seed);
    HapticSession session(testing::mixed_scene(1 + seed % 2), testing::haptic_options());
    HapticRecordingWriter writer(file(), {}, session);
    TissueGiver giver(session, seed);
    HandsAtRandom hands(session, seed);
    for (int k = 0; k < 500; ++k) {
      if ((k * 7) % 5 < 2) giver.give();
      writer.add(hands.tick(k));
    }
    writer.finish({});
    count(hands, giver);
    expect_complete();
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(totals_.early, 500);
  EXPECT_GT(totals_.resets, 50);
  EXPECT_GT(totals_.couplings, 100);
  EXPECT_GT(totals_.meshes, 50);
}

TEST_F(CheckHapticInputs, AreNeitherProvenNorReplayedWithAnotherTurnOrNone) {
  record_turn();
  expect_complete();
  EXPECT_EQ(totals_.early, 1);
  const auto replace = [](std::string& text, const std::string& from, const std::string& to) {
    const std::size_t place = text.find(from);
    ASSERT_NE(place, std::string::npos) << text;
    text.replace(place, from.size(), to);
  };
  const std::vector<std::function<void(std::string&)>> edits{
      [&](std::string& text) { replace(text, "\"from\":0.3", "\"from\":0.4"); },
      [&](std::string& text) { replace(text, "\"snapshot\":2", "\"snapshot\":3"); },
      [](std::string& text) { text.clear(); }};
  for (std::size_t k = 0; k < edits.size(); ++k) {
    SCOPED_TRACE(k);
    record_turn();
    edit_inputs(edits[k]);
    const testing::Answer answer = testing::check(file());
    EXPECT_EQ(answer.code, testing::kUnusable) << answer.text;
    EXPECT_NE(answer.error.find("sets out elsewhere"), std::string::npos) << answer.error;
    EXPECT_FALSE(is_replayed());
  }
}

TEST_F(CheckHapticInputs, AreNotReplayedWithoutOtherSpringsOrAnotherPlace) {
  for (const bool is_reset : {false, true}) {
    record_change(is_reset);
    expect_complete();
    edit_inputs([](std::string& text) { text.clear(); });
    EXPECT_FALSE(is_replayed());
  }
}

TEST_F(CheckHapticInputs, AreAllInTheFileFromTwoThreads) {
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    SCOPED_TRACE(seed);
    HapticSession session(testing::mixed_scene(1 + seed % 2), testing::haptic_options());
    HapticRecordingWriter writer(file(), {}, session);
    TissueGiver giver(session, seed);
    HandsAtRandom hands(session, seed);
    std::jthread tissue([&](const std::stop_token& stop) {
      while (!stop.stop_requested()) giver.give();
    });
    for (int k = 0; k < 1500; ++k) {
      writer.add(hands.tick(k));
      std::this_thread::sleep_for(std::chrono::microseconds(20));  // on one processor, too
    }
    tissue.request_stop();
    tissue.join();
    writer.finish({});
    count(hands, giver);
    expect_complete();
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(totals_.early, 20);
  RecordProperty("waiting", totals_.waiting);
  RecordProperty("resumed", totals_.resumed);
}

}  // namespace
}  // namespace dyop
