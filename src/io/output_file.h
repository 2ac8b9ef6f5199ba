// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <initializer_list>
#include <string_view>

#include "dyop/core/export.h"

namespace dyop::io_internal {

/// Replaces a file as a whole. The bytes go to a file beside it, which takes its name once all of
/// them are on the disk: a reader finds the old file or the new one, and a full disk leaves the old
/// one. A link is followed; what is no regular file, such as a pipe, is written directly.
/// @throws FileError if it cannot be written completely.
DYOP_EXPORT void write_whole_file(const std::filesystem::path& file, std::string_view bytes);

/// Refuses to write over what a command reads, also through a link or under another spelling.
/// @throws FileError if `out` is one of the inputs; empty paths are ignored.
DYOP_EXPORT void require_other_than(const std::filesystem::path& out,
                                    std::initializer_list<std::filesystem::path> inputs);

}  // namespace dyop::io_internal
