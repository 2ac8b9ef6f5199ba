// SPDX-License-Identifier: BSD-3-Clause
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <bit>
#include <chrono>
#include <map>
#include <random>
#include <thread>

#include "dyop/io/file_error.h"
#include "dyop/io/recording.h"
#include "io/file_bytes.h"
#include "io/record/recorded_world.h"
#include "support/damaged_files.h"
#include "support/message_of.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

namespace fs = std::filesystem;
using testing::TemporaryDirectory;

void add_bits(std::string& bytes, Scalar x) {
  const auto bits = std::bit_cast<std::array<char, sizeof x>>(x);
  bytes.append(bits.begin(), bits.end());
}

// All that a reader tells of a recording.
std::uint64_t content_of(const fs::path& file) {
  const RecordingReader reader(file);
  std::string bytes = reader.header().title + reader.header().scene;
  for (std::size_t k = 0; k < reader.frames().size(); ++k) {
    const RecordedFrame& frame = reader.frames()[k];
    for (const Scalar x : {frame.interval.begin, frame.interval.end, frame.kinetic_energy})
      add_bits(bytes, x);
    for (std::size_t body = 0; body < reader.bodies().size(); ++body) {
      for (const Scalar part : {0.0, 0.37, 1.0}) {
        const Scalar t = frame.interval.begin + part * frame.interval.length();
        const auto X_WB = reader.pose(BodyId(body), t);
        for (const Scalar x : X_WB.translation()) add_bits(bytes, x);
        for (const Scalar x : X_WB.rotation().reshaped()) add_bits(bytes, x);
      }
    }
    for (const PairRecord& pair : reader.pairs(k)) {
      add_bits(bytes, pair.gap_lower);
      for (const PairContact& contact : pair.contacts) add_bits(bytes, contact.impulse_W.z());
    }
  }
  for (const ImpactEvent& impact : reader.impacts()) {
    add_bits(bytes, impact.t);
    add_bits(bytes, Scalar(impact.contacts.size()));
  }
  return io_internal::digest_of(bytes);
}

TEST(RecordingDamage, OfOneBitIsAnErrorOrChangesNothing) {
  const TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  testing::record_busy_run(file);
  EXPECT_GT(testing::flip_bits(
                file, [&] { return content_of(file); }, 120),
            12);
}

TEST(RecordingDamage, AFileHasOneWriter) {
  const TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  {
    const RecordingWriter first(file, testing::busy_header());
    const std::string message = testing::message_of<FileError>(
        [&] { const RecordingWriter second(file, testing::busy_header()); });
    EXPECT_NE(message.find("is being recorded to by another run"), std::string::npos) << message;
    EXPECT_NO_THROW(RecordingReader{file});
  }
  EXPECT_NO_THROW((RecordingWriter{file, testing::busy_header()}));
}

// As on a full disk, in a process of its own: HDF5 keeps what it could not write until it ends.
TEST(RecordingDamage, ARunWithoutSpaceFailsAndDoesNotLookWhole) {
  const TemporaryDirectory directory;
  const fs::path file = directory.path() / "run.h5";
  for (const rlim_t bytes : {1'000U, 30'000U, 100'000U, 300'000U}) {
    const pid_t child = fork();
    if (child == 0) {
      ::signal(SIGXFSZ, SIG_IGN);
      const rlimit small{bytes, bytes};
      ::setrlimit(RLIMIT_FSIZE, &small);
      try {
        testing::record_busy_run(file);
      } catch (const FileError&) {
        _exit(1);
      } catch (...) {
        _exit(2);
      }
      _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 1) << bytes << ": " << status;
    try {
      EXPECT_FALSE(RecordingReader(file).end().has_value()) << bytes;
    } catch (const FileError&) {
    }
    for (const auto& entry : fs::directory_iterator(directory.path()))
      EXPECT_EQ(entry.path(), file) << bytes;
  }
}

// HDF5 holds a shared lock for a moment whenever a reader opens a file.
TEST(RecordingDamage, AReaderThatIsOpeningTheFileDoesNotStopItsWriter) {
  const TemporaryDirectory directory;
  const fs::path file = directory.write("run.h5", "");
  const int reader = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  ASSERT_GE(reader, 0);
  ASSERT_EQ(::flock(reader, LOCK_SH), 0);
  testing::record_busy_run(file);
  ::close(reader);
  EXPECT_GT(RecordingReader(file).frames().size(), 0U);
}

}  // namespace
}  // namespace dyop
