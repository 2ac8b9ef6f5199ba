// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "dyop/io/scene_file.h"
#include "io/json_reader.h"

namespace dyop::io_internal {

/// Whether the root of a file is a scene of [Ferguson2021], recognised by its key
/// "rigid_body_problem".
bool is_rigid_ipc_scene(const JsonNode& root);

/// Reads such a scene, see docs/formats.md. Meshes are searched for in the folders `meshes`
/// beside and above the scene, then in `mesh_directories`. Does not set `scene.source`.
void read_rigid_ipc_scene(const JsonNode& root,
                          const std::vector<std::filesystem::path>& mesh_directories, Scene& scene);

}  // namespace dyop::io_internal
