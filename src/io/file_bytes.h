// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "dyop/core/export.h"

namespace dyop::io_internal {

/// All bytes of a file. Throws FileError if it is missing, not a file, or cannot be read.
DYOP_EXPORT std::string read_bytes(const std::filesystem::path& file);

/// The same, decompressed with gzip. Throws FileError also if the compressed data is damaged, or
/// holds more than `most_bytes`.
std::string read_gzip_bytes(const std::filesystem::path& file, std::size_t most_bytes);

}  // namespace dyop::io_internal
