#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "dyop/geometry/triangle_mesh.h"

namespace dyop::testing {

/// A file in the first directory that has it: those of the environment variable DYOP_MESH_PATH
/// (separated by colons, as for the dyop command), then where the packages and examples/run.sh put
/// the models.
std::optional<std::filesystem::path> find_model(const std::string& name);

/// The mesh of a file about the middle of its bounds, scaled to a bounding radius of 1.
TriangleMesh load_unit_model(const std::filesystem::path& file);

}  // namespace dyop::testing
