// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstdlib>

#include "dyop/io/file_error.h"
#include "dyop/view/run_files.h"
#include "support/message_of.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

using testing::message_of;
using testing::TemporaryDirectory;

TEST(FramePictures, RefuseOptionsOutOfRangeByName) {
  const TemporaryDirectory directory;
  const auto page = directory.write("page.html", "<!doctype html>");
  FrameOptions options;
  options.width = 3;
  EXPECT_NE(message_of([&] { write_frames(page, directory.path() / "frames", options); }).find("3"),
            std::string::npos);
  options = {};
  options.frames_per_second = 0;
  EXPECT_THROW(write_frames(page, directory.path() / "frames", options), InvalidArgument);
  options = {};
  options.time_per_second = std::nan("");
  EXPECT_THROW(write_frames(page, directory.path() / "frames", options), InvalidArgument);
}

TEST(FramePictures, SayThatTheBrowserIsMissing) {
  const TemporaryDirectory directory;
  const auto page = directory.write("page.html", "<!doctype html>");
  FrameOptions options;
  options.browser = (directory.path() / "no-browser").string();
  const std::string message =
      message_of<FileError>([&] { write_frames(page, directory.path() / "frames", options); });
  EXPECT_NE(message.find("no-browser"), std::string::npos) << message;
  EXPECT_NE(message.find("apt-get install chromium"), std::string::npos) << message;
}

TEST(FramePictures, SayThatFfmpegIsMissingBeforeTheyDrawAnything) {
  const TemporaryDirectory directory;
  const auto page = directory.write("page.html", "<!doctype html>");
  FrameOptions options;
  options.browser = "/bin/true";  // is there, but draws nothing
  const std::string path = std::getenv("PATH");
  setenv("PATH", directory.path().c_str(), 1);
  const std::string message =
      message_of<FileError>([&] { write_frames(page, directory.path() / "film.mp4", options); });
  setenv("PATH", path.c_str(), 1);
  EXPECT_NE(message.find("apt-get install ffmpeg"), std::string::npos) << message;
}

}  // namespace
}  // namespace dyop
