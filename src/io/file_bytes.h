// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>

#include "dyop/core/export.h"

namespace dyop::io_internal {

/// All bytes of a file. Throws FileError if it is missing, not a file, or cannot be read.
DYOP_EXPORT std::string read_bytes(const std::filesystem::path& file);

/// The same, decompressed with gzip. Throws FileError also if the compressed data is damaged, or
/// holds more than `most_bytes`.
std::string read_gzip_bytes(const std::filesystem::path& file, std::size_t most_bytes);

/// Replaces a file as a whole. The bytes go to a file beside it, which takes its name once all of
/// them are on the disk: a reader finds the old file or the new one, and a full disk leaves the old
/// one. A link is followed; what is no regular file, such as a pipe, is written directly.
/// @throws FileError if it cannot be written completely.
DYOP_EXPORT void write_whole_file(const std::filesystem::path& file, std::string_view bytes);

/// Refuses to write over what a command reads, also through a link or under another spelling.
/// @throws FileError if `out` is one of the inputs; empty paths are ignored.
DYOP_EXPORT void require_other_than(const std::filesystem::path& out,
                                    std::initializer_list<std::filesystem::path> inputs);

/// FNV-1a, 64 bits: any one changed byte changes it. It guards against damage, not against
/// forgers.
DYOP_EXPORT std::uint64_t digest_of(std::string_view bytes);

/// The same over numbers.
DYOP_EXPORT std::uint64_t digest_of(std::span<const std::uint64_t> words);

/// Sixteen digits.
DYOP_EXPORT std::string hex_digits(std::uint64_t value);

}  // namespace dyop::io_internal
