#include "support/models.h"

#include <cstdlib>
#include <sstream>

#include "dyop/io/mesh_file.h"

namespace dyop::testing {

std::optional<std::filesystem::path> find_model(const std::string& name) {
  const char* variable = std::getenv("DYOP_MESH_PATH");
  std::istringstream directories((variable ? std::string(variable) + ":" : "") + DYOP_MODEL_PATH);
  for (std::string directory; std::getline(directories, directory, ':');) {
    const std::filesystem::path file = std::filesystem::path(directory) / name;
    if (!directory.empty() && std::filesystem::is_regular_file(file)) return file;
  }
  return std::nullopt;
}

TriangleMesh load_unit_model(const std::filesystem::path& file) {
  const TriangleMesh mesh = place_mesh(load_mesh(file), {.center = MeshCenter::Bounds});
  return place_mesh(mesh, {.scale = 1 / mesh.bounding_radius()});
}

}  // namespace dyop::testing
