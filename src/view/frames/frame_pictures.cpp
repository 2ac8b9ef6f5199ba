// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <thread>

#include "dyop/core/error.h"
#include "dyop/io/file_error.h"
#include "dyop/view/run_files.h"
#include "view/frames/browser_pipe.h"

namespace dyop {
namespace {

namespace fs = std::filesystem;

constexpr const char* kBrowser = "chromium";
constexpr int kLeastSize = 16;
constexpr int kMostSize = 8192;
constexpr std::chrono::milliseconds kBetweenLooks{50};
constexpr int kMostLooks = 12000;  // ten minutes for a page to be read

void check(const FrameOptions& options) {
  for (const int size : {options.width, options.height}) {
    DYOP_REQUIRE(kLeastSize <= size && size <= kMostSize, "width and height of frames must be ",
                 kLeastSize, " to ", kMostSize, ", not ", size);
  }
  DYOP_REQUIRE(options.frames_per_second > 0 && std::isfinite(options.frames_per_second),
               "frames per second must be positive, not ", options.frames_per_second);
  DYOP_REQUIRE(options.time_per_second > 0 && std::isfinite(options.time_per_second),
               "time per second must be positive, not ", options.time_per_second);
}

// The characters of a path that mean something else in an address are spelled out.
std::string address_of(const fs::path& page, const std::string& link) {
  std::string address = "file://";
  for (const char c : fs::absolute(page).string()) {
    const bool is_plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '/' ||
                          c == '-' || c == '_' || c == '.' || c == '~';
    std::array<char, 4> code{};
    std::snprintf(code.data(), code.size(), "%%%02X", static_cast<unsigned char>(c));
    address += is_plain ? std::string(1, c) : std::string(code.data());
  }
  return address + "#bare=1" + (link.empty() ? "" : "&" + link);
}

void wait_until_ready(view_internal::BrowserPipe& browser, const fs::path& page) {
  for (int k = 0; k < kMostLooks; ++k) {
    if (browser.evaluate("Boolean(window.dyop && window.dyop.isReady)") == true) return;
    const auto notice = browser.evaluate(
        "document.getElementById('notice')?.hidden === false ? "
        "document.getElementById('notice').textContent : ''");
    if (notice.is_string() && notice != "") throw FileError(page, notice.get<std::string>());
    std::this_thread::sleep_for(kBetweenLooks);
  }
  throw FileError(page, "is not read in time");
}

fs::path frame_file(const fs::path& directory, std::int64_t k) {
  std::array<char, 32> name{};
  std::snprintf(name.data(), name.size(), "frame-%05lld.png", static_cast<long long>(k));
  return directory / name.data();
}

std::int64_t write_pictures(const fs::path& page, const fs::path& directory,
                            const FrameOptions& options) {
  view_internal::BrowserPipe browser(options.browser.empty() ? kBrowser : options.browser,
                                     options.width, options.height);
  browser.open(address_of(page, options.link));
  wait_until_ready(browser, page);
  const auto run_begin = browser.evaluate("window.dyop.run.begin").get<Scalar>();
  const auto run_end = browser.evaluate("window.dyop.run.end").get<Scalar>();
  const Scalar begin = options.from.value_or(run_begin);
  const Scalar end = options.to.value_or(run_end);
  DYOP_REQUIRE(run_begin <= begin && begin <= end && end <= run_end, "frames from ", begin, " to ",
               end, ": the run goes from ", run_begin, " to ", run_end);
  const Scalar step = options.time_per_second / options.frames_per_second;
  const Scalar count_wanted = std::floor((end - begin) / step) + 1;
  DYOP_REQUIRE(count_wanted <= Scalar(options.most_frames), "the run makes ", count_wanted,
               " frames, more than ", options.most_frames);
  const auto count = std::int64_t(count_wanted);
  for (std::int64_t k = 0; k < count; ++k) {
    // Times go through JSON, which keeps every digit.
    const std::string t = nlohmann::json(std::min(begin + Scalar(k) * step, end)).dump();
    browser.evaluate("window.dyop.show(" + t + ").then(() => null)");
    const fs::path file = frame_file(directory, k);
    std::ofstream out(file, std::ios::binary);
    out << browser.picture();
    out.close();
    if (!out) throw FileError(file, "could not be written");
  }
  return count;
}

void make_film(const fs::path& directory, const fs::path& out, Scalar frames_per_second) {
  const int status = view_internal::run_program(
      {"ffmpeg", "-y", "-loglevel", "error", "-framerate", std::to_string(frames_per_second), "-i",
       (directory / "frame-%05d.png").string(), "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt",
       "yuv420p", out.string()});
  if (status != 0) {
    throw FileError(out, "ffmpeg ended with exit code " + std::to_string(status));
  }
}

}  // namespace

std::int64_t write_frames(const fs::path& page, const fs::path& out, const FrameOptions& options) {
  check(options);
  // Before the first frame is drawn, not after the last.
  view_internal::require_program(options.browser.empty() ? kBrowser : options.browser, kBrowser);
  if (out.extension() == ".mp4") {
    view_internal::require_program("ffmpeg", "ffmpeg");
    const view_internal::ScratchFolder frames("frames");
    const std::int64_t count = write_pictures(page, frames.path(), options);
    make_film(frames.path(), out, options.frames_per_second);
    return count;
  }
  std::error_code error;
  fs::create_directories(out, error);
  if (error) throw FileError(out, "could not be created: " + error.message());
  return write_pictures(page, out, options);
}

}  // namespace dyop
