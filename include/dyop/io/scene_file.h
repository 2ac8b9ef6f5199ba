// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "dyop/core/types.h"
#include "dyop/dynamics/world.h"

namespace DYOP_EXPORT dyop {

/// A pair with a target distance of its own.
struct SceneTarget {
  BodyId a;
  BodyId b;
  Scalar distance = 0;
};

/// A pair with a material of its own.
struct ScenePairMaterial {
  BodyId a;
  BodyId b;
  Material material;
};

/// A scene file, read and checked: everything a World needs. Format: docs/formats.md.
struct Scene {
  std::string title;
  /// The JSON of the file on one line, keys in the order of the file.
  std::string source;
  /// `thread_count` is not part of a scene and keeps its default.
  WorldOptions options;
  std::vector<BodyDefinition> bodies;    ///< BodyId::slot is the index into this list
  std::vector<std::string> shape_names;  ///< per body, for display: "mesh bunny.obj", "sphere"
  std::vector<SceneTarget> target_distances;
  std::vector<std::pair<BodyId, BodyId>> disabled_pairs;
  std::vector<ScenePairMaterial> materials;
  std::vector<JointDefinition> joints;  ///< JointId::number is the index into this list
  std::vector<SpringDefinition> springs;
  Scalar end_time = 0;  ///< > 0; a scene starts at time 0
  Scalar step = 0;      ///< > 0; length of one World::advance()
};

/// Returns the scene of a file. Meshes are sought relative to the directory of the scene file, then
/// in each of `mesh_directories`.
/// @throws FileError with the file, the path of the key, what was expected and found.
Scene load_scene(const std::filesystem::path& file,
                 const std::vector<std::filesystem::path>& mesh_directories = {});

/// The world of a scene, at time 0.
/// @throws InvalidArgument if the World rejects a body; the message names it.
World make_world(const Scene& scene);

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
