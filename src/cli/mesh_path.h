// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace dyop::cli {

/// The directories of --mesh-path, then those of the environment variable DYOP_MESH_PATH.
std::vector<std::filesystem::path> mesh_directories(const std::vector<std::string>& mesh_path);

/// The file that a name on the command line stands for: - is standard input.
inline std::filesystem::path input_file(const std::string& name) {
  return name == "-" ? "/dev/stdin" : name;
}

}  // namespace dyop::cli
