// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>

#include "dyop/io/file_error.h"
#include "dyop/io/mesh_file.h"
#include "io/file_bytes.h"
#include "support/message_of.h"
#include "support/temporary_directory.h"

namespace dyop::io_internal {
namespace {

namespace fs = std::filesystem;
using testing::TemporaryDirectory;

class OutputFile : public ::testing::Test {
 protected:
  std::size_t file_count() const {
    return std::size_t(std::distance(fs::directory_iterator(directory_.path()), {}));
  }
  fs::path file(const char* name) const { return directory_.path() / name; }

  TemporaryDirectory directory_;
};

TEST_F(OutputFile, ReplacesAFileAndLeavesNothingBeside) {
  write_whole_file(file("a"), "first");
  EXPECT_EQ(TemporaryDirectory::read(file("a")), "first");
  ASSERT_EQ(chmod(file("a").c_str(), 0640), 0);
  write_whole_file(file("a"), "");
  EXPECT_EQ(TemporaryDirectory::read(file("a")), "");
  struct stat status {};
  ASSERT_EQ(stat(file("a").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777, 0640u);
  EXPECT_EQ(file_count(), 1u);
}

TEST_F(OutputFile, WritesWhatALinkNames) {
  write_whole_file(file("target"), "old");
  fs::create_symlink("target", file("link"));
  write_whole_file(file("link"), "new");
  EXPECT_TRUE(fs::is_symlink(file("link")));
  EXPECT_EQ(TemporaryDirectory::read(file("target")), "new");
}

TEST_F(OutputFile, KeepsTheOldFileWhereTheDiskIsFull) {
  write_whole_file(file("a"), "old");
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &limit), 0);
  const rlimit small{1000, limit.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  EXPECT_THROW(write_whole_file(file("a"), std::string(5000, 'x')), FileError);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(TemporaryDirectory::read(file("a")), "old");
  EXPECT_EQ(file_count(), 1u);
}

TEST_F(OutputFile, ReportsWhatCannotBeWritten) {
  EXPECT_THROW(write_whole_file(file("missing/a"), "x"), FileError);
  EXPECT_THROW(write_whole_file(directory_.path(), "x"), FileError);
  EXPECT_THROW(write_whole_file("/dev/full", "x"), FileError);
  EXPECT_NO_THROW(write_whole_file("/dev/null", "x"));
}

TEST_F(OutputFile, IsNoneOfTheInputs) {
  write_whole_file(file("a"), "x");
  fs::create_symlink("a", file("link"));
  EXPECT_THROW(require_other_than(file("a"), {file("b"), file("a")}), FileError);
  EXPECT_THROW(require_other_than(file("link"), {file("a")}), FileError);
  EXPECT_THROW(require_other_than(directory_.path() / "." / "a", {file("a")}), FileError);
  EXPECT_NO_THROW(require_other_than(file("b"), {file("a"), ""}));
  EXPECT_NO_THROW(require_other_than("", {file("a")}));
}

TEST_F(OutputFile, OfGzipMayNotUnpackToMoreThanItsLimit) {
  // 400 zeros, by gzip -9n.
  const std::string bytes(
      "\x1f\x8b\x08\x00\x00\x00\x00\x00\x02\xff\x63\x60\x18\x05\x83\x09\x00\x00\x0c\x0d\x22\x46"
      "\x90\x01\x00\x00",
      26);
  const fs::path mesh = directory_.write("zeros.obj.gz", bytes);
  const std::string message = testing::message_of<FileError>([&] { load_mesh(mesh, {100}); });
  EXPECT_NE(message.find("more than 100 bytes"), std::string::npos) << message;
}

}  // namespace
}  // namespace dyop::io_internal
