// SPDX-License-Identifier: BSD-3-Clause
#include "cli/mesh_path.h"
#include "cli/recording/recording_tools.h"
#include "dyop/scene_io/scene_file.h"
#include "dyop/scene_io/scene_recording.h"

namespace dyop::cli {

ExitCode export_recording(const ExportArguments& arguments) {
  const std::filesystem::path out = arguments.out;
  DYOP_REQUIRE(is_recording(out), "-o ", arguments.out, ": expected a file .h5");
  DYOP_REQUIRE(!arguments.scene.empty(),
               "a recording as text has no shapes: --scene SCENE is required");
  const Scene scene = load_scene(arguments.scene, mesh_directories(arguments.mesh_path));
  convert_recording(arguments.recording, scene, out);
  return ExitCode::Answered;
}

}  // namespace dyop::cli
