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

}  // namespace dyop
