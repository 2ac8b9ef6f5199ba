// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/view/frame_pictures.h"

#include <gtest/gtest.h>

#include "dyop/core/error.h"
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
  EXPECT_THROW(write_frames(page, directory.path() / "frames", options), Error);
}

}  // namespace
}  // namespace dyop
