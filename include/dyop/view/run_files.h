// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dyop/core/export.h"
#include "dyop/core/types.h"
#include "dyop/view/page_encoder.h"

namespace DYOP_EXPORT dyop {

/// Whether this dyop was built with its page (it needs npm packages, see docs/player.md).
bool has_page();

/// A self-contained HTML page that plays a run: PageEncoder's blocks within the page's own code.
/// Opens from a file; needs no network.
/// @throws InvalidArgument unless has_page().
std::string page_html(std::string_view title, std::span<const std::string> blocks);

/// The same page without a run: it fetches its blocks from the server that it comes from, and
/// controls the run there (LiveServer).
/// @throws InvalidArgument unless has_page().
std::string live_page_html(std::string_view title);

struct RecordedPageOptions {
  /// Number of pairs, those that come nearest, whose gap is plotted over the whole run.
  int gap_pairs = 6;
  /// Largest number of times; each costs one distance query per pair.
  int gap_samples = 300;
  /// With more segments and contacts than this, the page holds outlines of the run and reads the
  /// rest when its time is looked at, so that it takes little memory.
  std::int64_t most_rows = 300000;
  /// How many of them the page then reads at a time, about; >= 1.
  std::int64_t rows_of_chunk = 20000;
  /// What a checker said of the recording, for the page to show; none: not asked.
  std::optional<PageVerdict> verdict = {};
};

/// The page (page_html()) of a recorded run, of a World (docs/formats.md) or of a tool
/// (docs/formats.md), also of one that is still being written or was killed: up to its last
/// frame.
/// @throws FileError if the recording cannot be read, InvalidArgument unless has_page() or if this
///         dyop was built without recordings.
std::string recorded_page_html(const std::filesystem::path& recording,
                               const RecordedPageOptions& options = {});

/// One page of two recorded runs of Worlds, side by side: one clock, one camera, and how far
/// bodies of the same name are apart.
/// @throws FileError, InvalidArgument as recorded_page_html(), also InvalidArgument for the
///         recording of a tool.
std::string compared_page_html(const std::filesystem::path& first,
                               const std::filesystem::path& second,
                               const RecordedPageOptions& options = {});

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

struct GltfOptions {
  /// How far the file's motion may be from the run's, besides rounding to single precision, as a
  /// part of the smallest bounding radius of the bodies that move; > 0.
  Scalar tolerance = 1e-4;  // literal: a fifth of the gap at which bodies rest
  /// The run's z is up, as glTF's y is. False: the run's y is up already.
  bool z_is_up = true;
};

/// Writes a recording of docs/formats.md as one binary glTF file (.glb): a node for every body,
/// animated by cubic splines whose tangents differ at an impact, so that every viewer shows the
/// exact kink.
///
/// Times, places and rotations are in single precision, as glTF wants it: events closer than its
/// resolution become one key.
/// @throws FileError if a file cannot be read or written, or this library was built without
///         tinygltf or HDF5; InvalidArgument if an option is out of its range.
void write_gltf(const std::filesystem::path& recording, const std::filesystem::path& out,
                const GltfOptions& options = {});

}  // namespace dyop
