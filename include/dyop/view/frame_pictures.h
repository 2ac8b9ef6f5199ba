// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "dyop/core/types.h"

namespace DYOP_EXPORT dyop {

struct FrameOptions {
  int width = 1280;  ///< pixels, 16 to 8192
  int height = 720;
  Scalar frames_per_second = 30;    ///< > 0, of the film
  Scalar time_per_second = 1;       ///< > 0, of the run that passes in a second of the film
  std::optional<Scalar> from = {};  ///< of the run; none: its start
  std::optional<Scalar> to = {};    ///< none: its end
  std::string browser = {};         ///< Chromium; empty: `chromium` on the path
  std::string link = {};            ///< of the page, without #: camera, theme; docs/player.md
  std::int64_t most_frames = 3600;  ///< more are refused
};

/// Draws a page (page_html()) at equal steps of time in Chromium without a window, and writes
/// DIR/frame-00000.png and so on, or, if `out` ends with .mp4, a film (ffmpeg).
/// Returns how many frames there are.
/// @throws InvalidArgument for an option out of its range or too many frames, FileError if Chromium
///         or ffmpeg cannot be started or fail, or a file cannot be written.
std::int64_t write_frames(const std::filesystem::path& page, const std::filesystem::path& out,
                          const FrameOptions& options = {});

}  // namespace dyop
