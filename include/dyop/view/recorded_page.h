// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "dyop/core/export.h"

namespace DYOP_EXPORT dyop {

struct RecordedPageOptions {
  /// Pairs whose gap is drawn over the whole run: those that come nearest.
  int gap_pairs = 6;
  /// At how many times at most; each costs a distance query for each of the pairs.
  int gap_samples = 300;
};

/// The page (page_html()) of a recorded run (docs/recording.md), also of one that is still being
/// written or was killed: up to its last frame.
/// @throws FileError if the recording cannot be read, InvalidArgument unless has_page() or if this
///         dyop was built without recordings.
std::string recorded_page_html(const std::filesystem::path& recording,
                               const RecordedPageOptions& options = {});

}  // namespace dyop
