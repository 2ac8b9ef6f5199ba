// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "io/json_reader.h"

namespace dyop::io_internal {

/// Parses one document of YAML by yaml-cpp, as the same tree of values as JSON. Anchors, aliases,
/// tags, keys that are no text, further documents and nesting deeper than JSON is read are refused.
/// @throws FileError with line and column; for a key that occurs twice, too.
DYOP_EXPORT Json parse_yaml(const std::filesystem::path& file, const std::string& text);

/// parse_yaml() of a file whose name ends in .yaml or .yml, parse_json() of others.
Json parse_structured(const std::filesystem::path& file, const std::string& text);

/// Whether the name ends in .yaml or .yml.
bool has_yaml_name(const std::filesystem::path& file);

}  // namespace dyop::io_internal
