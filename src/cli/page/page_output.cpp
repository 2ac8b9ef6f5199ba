// SPDX-License-Identifier: BSD-3-Clause
#include "cli/page/page_output.h"

#include <unistd.h>

#include <fstream>

#include "dyop/io/file_error.h"

namespace dyop::cli {
namespace {

namespace fs = std::filesystem;

// A file that is gone at the end.
struct ScratchPage {
  fs::path file = fs::temp_directory_path() / ("dyop-page-" + std::to_string(getpid()) + ".html");
  ~ScratchPage() {
    std::error_code ignored;
    fs::remove(file, ignored);
  }
};

}  // namespace

void add_frame_options(CLI::App& command, FrameOptions& options) {
  command.add_option("--fps", options.frames_per_second, "Frames per second of the film")
      ->capture_default_str();
  command.add_option("--speed", options.time_per_second, "Time of the run per second of the film")
      ->capture_default_str();
  command.add_option("--from", options.from, "Time of the first frame");
  command.add_option("--to", options.to, "Time up to which there are frames");
  command.add_option("--width", options.width, "Of frames, in pixels")->capture_default_str();
  command.add_option("--height", options.height, "Of frames, in pixels")->capture_default_str();
  command.add_option("--link", options.link, "Camera and theme of frames: what a link has after #");
  command.add_option("--browser", options.browser, "Chromium, if it is not on the path");
}

void write_page(const fs::path& file, const std::string& html) {
  std::ofstream out(file, std::ios::binary);
  if (!out) throw FileError(file, "cannot be written");
  out << html;
  out.close();
  if (!out) throw FileError(file, "cannot be written to its end");
}

std::int64_t write_page_frames(const std::string& html, const fs::path& out,
                               const FrameOptions& options) {
  const ScratchPage page;
  write_page(page.file, html);
  return write_frames(page.file, out, options);
}

}  // namespace dyop::cli
