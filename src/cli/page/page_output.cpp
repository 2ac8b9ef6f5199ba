// SPDX-License-Identifier: BSD-3-Clause
#include "cli/page/page_output.h"

#include "io/file_bytes.h"
#include "view/frames/browser_pipe.h"

namespace dyop::cli {
namespace {

namespace fs = std::filesystem;

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

void add_live_options(CLI::App& command, LivePage& page) {
  command.add_option("--port", page.port, "Of the page with --live; 0: any that is free")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  command.add_flag("--end-with-run", page.ends_with_run,
                   "With --live: do not wait for Ctrl-C once the run is over");
}

void write_page(const fs::path& file, const std::string& html) {
  io_internal::write_whole_file(file, html);
}

std::int64_t write_page_frames(const std::string& html, const fs::path& out,
                               const FrameOptions& options) {
  // A folder that only this user can enter: in a shared one others could leave a link of that name.
  const view_internal::ScratchFolder folder("page");
  const fs::path page = folder.path() / "page.html";
  write_page(page, html);
  return write_frames(page, out, options);
}

}  // namespace dyop::cli
