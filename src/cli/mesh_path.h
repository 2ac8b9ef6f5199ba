// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace dyop::cli {

/// The directories of --mesh-path, then those of the environment variable DYOP_MESH_PATH.
std::vector<std::filesystem::path> mesh_directories(const std::vector<std::string>& mesh_path);

}  // namespace dyop::cli
