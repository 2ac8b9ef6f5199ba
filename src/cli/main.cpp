// SPDX-License-Identifier: BSD-3-Clause
#include <exception>
#include <iostream>
#include <new>
#include <string>

#include "cli/commands.h"
#include "cli/printable_stream.h"
#include "dyop/core/error.h"
#include "dyop/dynamics/integrator.h"

namespace dyop::cli {
namespace {

constexpr const char* kExitCodes = R"(Exit codes:
  0  the question was answered, whatever the answer
  1  --fail-on-impact: an impact or an overlap was found; replay: the answers differ;
     check: refuted
  2  bad input: a file, an option or a value cannot be used
  3  undecided: a budget, a limit or Ctrl-C ended the work first; partial results are printed
  4  internal error

Examples:
  dyop toi sphere:0.5 box:1,1,1 --position-a -3 0 0 --velocity-a 1 0 0 --interval 0 10
  dyop simulate examples/scenes/bunny-throw.json -o run.h5 --mesh-path /usr/share/glmark2/models
)";

// One line, whatever the names in it contain.
ExitCode report(ExitCode code, std::string message) {
  for (char& c : message) {
    if (static_cast<unsigned char>(c) < ' ') c = ' ';
  }
  std::cerr << "dyop: error: " << message << '\n';
  return code;
}

bool has_command(const CLI::App& app, const std::string& name) {
  const auto commands =
      app.get_subcommands([&](const CLI::App* command) { return command->get_name() == name; });
  return !commands.empty();
}

ExitCode run(CLI::App& app, int argc, char** argv, const ExitCode& exit_code) {
  try {
    // The parser would only report a missing command.
    const std::string first = argc > 1 ? argv[1] : "";
    if (!first.empty() && first.front() != '-' && !has_command(app, first)) {
      return report(ExitCode::BadInput, "unknown command '" + first + "' (see dyop --help)");
    }
    app.parse(argc, argv);
    std::cout.flush();
    return std::cout ? exit_code : report(ExitCode::BadInput, "could not write the output");
  } catch (const CLI::Success& request) {  // --help, --version
    app.exit(request);
    return ExitCode::Answered;
  } catch (const CLI::ParseError& error) {
    return report(ExitCode::BadInput, std::string(error.what()) + " (see dyop --help)");
  } catch (const InternalError& error) {
    return report(ExitCode::Internal, error.what());
  } catch (const IntegrationError& error) {
    return report(ExitCode::Undecided, error.what());
  } catch (const Error& error) {
    return report(ExitCode::BadInput, error.what());
  } catch (const std::bad_alloc&) {
    return report(ExitCode::Internal, "out of memory");
  } catch (const std::exception& error) {
    return report(ExitCode::Internal, error.what());
  } catch (...) {
    return report(ExitCode::Internal, "unknown exception");
  }
}

}  // namespace
}  // namespace dyop::cli

int main(int argc, char** argv) {
  using dyop::cli::ExitCode;
  const dyop::cli::PrintableStream out(std::cout);
  const dyop::cli::PrintableStream err(std::cerr);
  CLI::App app("Certified time of impact and stepping of rigid bodies", "dyop");
  app.footer(dyop::cli::kExitCodes);
  app.set_version_flag("--version", std::string("dyop " DYOP_VERSION));
  app.require_subcommand(1);
  ExitCode exit_code = ExitCode::Answered;
  // To add a command: one file <name>_command.cpp, one line in commands.h, one here.
  dyop::cli::add_distance_command(app, exit_code);
  dyop::cli::add_toi_command(app, exit_code);
  dyop::cli::add_simulate_command(app, exit_code);
  dyop::cli::add_scene_command(app, exit_code);
  dyop::cli::add_export_command(app, exit_code);
  dyop::cli::add_info_command(app, exit_code);
  dyop::cli::add_check_command(app, exit_code);
  dyop::cli::add_paper_command(app, exit_code);
  dyop::cli::add_replay_command(app, exit_code);
  dyop::cli::add_view_command(app, exit_code);
  dyop::cli::add_tool_command(app, exit_code);
  dyop::cli::add_robot_command(app, exit_code);
  dyop::cli::add_study_command(app, exit_code);
  return int(dyop::cli::run(app, argc, argv, exit_code));
}
