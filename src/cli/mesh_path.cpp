// SPDX-License-Identifier: BSD-3-Clause
#include "cli/mesh_path.h"

#include <cstdlib>
#include <sstream>

namespace dyop::cli {

std::vector<std::filesystem::path> mesh_directories(const std::vector<std::string>& mesh_path) {
  std::vector<std::filesystem::path> directories(mesh_path.begin(), mesh_path.end());
  if (const char* variable = std::getenv("DYOP_MESH_PATH")) {
    std::istringstream list(variable);
    for (std::string directory; std::getline(list, directory, ':');) {
      if (!directory.empty()) directories.emplace_back(directory);
    }
  }
  return directories;
}

}  // namespace dyop::cli
