// SPDX-License-Identifier: BSD-3-Clause
#include "cli/body_arguments.h"
#include "cli/commands.h"
#include "cli/recording/recording_tools.h"

namespace dyop::cli {
namespace {

constexpr const char* kExportExamples =
    R"(-o FILE.glb writes binary glTF, which Blender and every other viewer plays; -o FILE.h5 takes a
recording as text.

Examples:
  For Blender:
    dyop export run.h5 -o run.glb
  A recording as text, from an earlier dyop, as HDF5:
    dyop export run/recording.jsonl --scene scene.json -o run.h5
)";

}  // namespace

void add_export_command(CLI::App& app, ExitCode& exit_code) {
  auto arguments = std::make_shared<ExportArguments>();
  CLI::App* command = app.add_subcommand("export", "A recorded run in another form");
  command->footer(kExportExamples);
  command->add_option("RECORDING", arguments->recording, "Recording (docs/recording.md)")
      ->required();
  command->add_option("-o,--out", arguments->out, "File to write; its ending says what")
      ->required();
  command->add_option("--scene", arguments->scene,
                      "Scene of a recording as text, which has no shapes");
  command
      ->add_option(
          "--tolerance", arguments->tolerance,
          "Of glTF: how far poses may be off, as a part of the smallest moving body's radius")
      ->check(require_positive)
      ->capture_default_str();
  command->add_option("--up", arguments->up, "Of glTF: the run's upward axis")
      ->check(CLI::IsMember({"z", "y"}))
      ->capture_default_str();
  command->add_option("--mesh-path", arguments->mesh_path, "More directories to search for meshes");
  command->callback([arguments, &exit_code] { exit_code = export_recording(*arguments); });
}

}  // namespace dyop::cli
