// SPDX-License-Identifier: BSD-3-Clause
#include "cli/body_arguments.h"
#include "cli/commands.h"
#include "cli/page/page_output.h"
#include "cli/recording/recording_tools.h"

namespace dyop::cli {
namespace {

constexpr const char* kExportExamples =
    R"(-o FILE.glb writes binary glTF, which Blender and every other viewer plays; -o FILE.mp4 a film;
--frames DIR pictures at equal steps of time. Pictures are drawn by Chromium without a window; a film
needs ffmpeg as well. `dyop info --json-lines` writes a recording as text.

Examples:
  For Blender:
    dyop export run.h5 -o run.glb
  A film at a tenth of the speed, and ten pictures for a paper:
    dyop export run.h5 -o run.mp4 --speed 0.1
    dyop export run.h5 --frames pictures --fps 10 --from 0.3 --to 1.2 --width 1920 --height 1080
)";

}  // namespace

void add_export_command(CLI::App& app, ExitCode& exit_code) {
  auto arguments = std::make_shared<ExportArguments>();
  CLI::App* command = app.add_subcommand("export", "A recorded run in another form");
  command->footer(kExportExamples);
  command->add_option("RECORDING", arguments->recording, "Recording (docs/formats.md)")->required();
  command->add_option("-o,--out", arguments->out, "File to write; its ending says what");
  command->add_option("--frames", arguments->frames, "Directory of pictures frame-00000.png, ...");
  add_frame_options(*command, arguments->frame_options);
  command
      ->add_option(
          "--tolerance", arguments->tolerance,
          "Of glTF: how far poses may be off, as a part of the smallest moving body's radius")
      ->check(require_positive)
      ->capture_default_str();
  command->add_option("--up", arguments->up, "Of glTF: the run's upward axis")
      ->check(CLI::IsMember({"z", "y"}))
      ->capture_default_str();
  command->callback([arguments, &exit_code] { exit_code = export_recording(*arguments); });
}

}  // namespace dyop::cli
