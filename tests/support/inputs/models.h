// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dyop/geometry/triangle_mesh.h"

namespace dyop::testing {

/// The directories of the environment variable DYOP_MESH_PATH (separated by colons, as for the dyop
/// command), then where the Debian package and examples/run.sh put the models.
std::vector<std::filesystem::path> model_directories();

/// The file in the first of these directories that has it.
std::optional<std::filesystem::path> find_model(const std::string& name);

/// The mesh of a file, centred at the middle of its bounds and scaled to a bounding radius of 1.
TriangleMesh load_unit_model(const std::filesystem::path& file);

}  // namespace dyop::testing
