// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "dyop/core/types.h"

namespace DYOP_EXPORT dyop {

/// A generated scene: the text of a scene file (docs/formats.md) and of the mesh files it
/// names.
struct GeneratedScene {
  std::string text;
  std::vector<std::pair<std::string, std::string>>
      meshes;  ///< file name beside the scene, OBJ text
};

/// One kind of scene that generate_scene() makes.
struct SceneKind {
  std::string name;
  std::string count;  ///< what N counts
  int least = 1;      ///< smallest N
  int most = 1;       ///< largest N
};

/// All kinds, in the order of the documentation.
const std::vector<SceneKind>& scene_kinds();

/// Generates a scene with z up, gravity 9.81 and bodies about one unit long. Bodies that rest on
/// each other start at their rest gap. The same arguments give the same text.
/// @throws InvalidArgument naming the kind or count that is not possible.
GeneratedScene generate_scene(const std::string& kind, int n);

/// Writes the scene to `file` and its meshes beside it.
/// @throws FileError
void write_generated_scene(const GeneratedScene& scene, const std::filesystem::path& file);

}  // namespace dyop
