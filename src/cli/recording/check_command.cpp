// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>
#include <sstream>

#include "check/check.h"
#include "cli/commands.h"
#include "cli/recording/recording_tools.h"

namespace dyop::cli {
namespace {

constexpr const char* kCheckExamples =
    R"(Reads nothing but the file, and shares no code with what computed the run (docs/check.md). The
program dyop-check does the same without the rest of dyop.

Examples:
    dyop simulate examples/scenes/arch.json -o run.h5
    dyop check run.h5
)";

}  // namespace

PageVerdict verdict_on(const std::filesystem::path& file) {
  std::ostringstream words;
  const int code = dyop_check::check_file(file.string(), 1, words, words);
  return {code == 0, file.filename().string() + ": " + words.str()};
}

void add_check_command(CLI::App& app, ExitCode& exit_code) {
  struct Arguments {
    std::string file;
    bool touching = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("check", "Prove from a recording that bodies kept apart");
  command->footer(kCheckExamples);
  command->add_option("RECORDING", arguments->file, "Recording of dyop simulate")->required();
  command->add_flag("--touching", arguments->touching, "Ask only that nothing touched");
  command->callback([arguments, &exit_code] {
    const double scale = arguments->touching ? 0 : 1;
    exit_code =
        static_cast<ExitCode>(dyop_check::check_file(arguments->file, scale, std::cout, std::cerr));
  });
}

}  // namespace dyop::cli
