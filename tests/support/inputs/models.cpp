// SPDX-License-Identifier: BSD-3-Clause
#include "support/inputs/models.h"

#include <cstdlib>
#include <sstream>

#include "dyop/io/mesh_file.h"

namespace dyop::testing {

std::vector<std::filesystem::path> model_directories() {
  const char* variable = std::getenv("DYOP_MESH_PATH");
  std::istringstream list((variable ? std::string(variable) + ":" : "") + DYOP_MODEL_PATH);
  std::vector<std::filesystem::path> directories;
  for (std::string directory; std::getline(list, directory, ':');) {
    if (!directory.empty()) directories.emplace_back(directory);
  }
  return directories;
}

std::optional<std::filesystem::path> find_model(const std::string& name) {
  for (const std::filesystem::path& directory : model_directories()) {
    if (std::filesystem::is_regular_file(directory / name)) return directory / name;
  }
  return std::nullopt;
}

TriangleMesh load_unit_model(const std::filesystem::path& file) {
  const TriangleMesh mesh = place_mesh(load_mesh(file), {.center = MeshCenter::Bounds});
  return place_mesh(mesh, {.scale = 1 / mesh.bounding_radius()});
}

}  // namespace dyop::testing
