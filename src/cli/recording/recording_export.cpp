// SPDX-License-Identifier: BSD-3-Clause
#include "cli/mesh_path.h"
#include "cli/recording/recording_tools.h"
#include "dyop/scene_io/scene_file.h"
#include "dyop/scene_io/scene_recording.h"
#include "dyop/view/gltf_file.h"

namespace dyop::cli {

ExitCode export_recording(const ExportArguments& arguments) {
  const std::filesystem::path out = arguments.out;
  if (out.extension() == ".glb") {
    GltfOptions options;
    options.tolerance = arguments.tolerance;
    options.z_is_up = arguments.up == "z";
    write_gltf(arguments.recording, out, options);
    return ExitCode::Answered;
  }
  DYOP_REQUIRE(is_recording(out), "-o ", arguments.out, ": expected a file .glb or .h5");
  DYOP_REQUIRE(!arguments.scene.empty(),
               "a recording as text has no shapes: --scene SCENE is required");
  const Scene scene = load_scene(arguments.scene, mesh_directories(arguments.mesh_path));
  convert_recording(arguments.recording, scene, out);
  return ExitCode::Answered;
}

}  // namespace dyop::cli
