// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "dyop/core/export.h"

namespace DYOP_EXPORT dyop {

struct RecordedPageOptions {
  /// Number of pairs, those that come nearest, whose gap is plotted over the whole run.
  int gap_pairs = 6;
  /// Largest number of times; each costs one distance query per pair.
  int gap_samples = 300;
};

/// The page (page_html()) of a recorded run, of a World (docs/formats.md) or of a tool
/// (docs/formats.md), also of one that is still being written or was killed: up to its last
/// frame.
/// @throws FileError if the recording cannot be read, InvalidArgument unless has_page() or if this
///         dyop was built without recordings.
std::string recorded_page_html(const std::filesystem::path& recording,
                               const RecordedPageOptions& options = {});

}  // namespace dyop
