// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <vector>

#include "cli/commands.h"
#include "cli/console.h"
#include "cli/suggestion.h"
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

`dyop help COMMAND` is `dyop COMMAND --help`. A file named - is standard input (simulate, robot check,
replay) or output (robot pairs --write-srdf).

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

ExitCode flushed(ExitCode code) {
  std::cout.flush();
  return std::cout ? code : report(ExitCode::BadInput, "could not write the output");
}

using Words = std::vector<std::string>;

std::vector<CLI::App*> commands_of(CLI::App& app) {
  return app.get_subcommands([](CLI::App*) { return true; });
}

CLI::App* find_command(CLI::App& app, const std::string& name) {
  for (CLI::App* command : commands_of(app)) {
    if (command->get_name() == name) return command;
  }
  return nullptr;
}

// The commands that the words begin with.
struct Named {
  CLI::App* command;
  std::string words;  // "dyop robot check"
};

Named named_command(CLI::App& app, const Words& words) {
  Named named{&app, app.get_name()};
  for (const std::string& word : words) {
    CLI::App* const found = find_command(*named.command, word);
    if (found == nullptr) break;
    named = {found, named.words + " " + word};
  }
  return named;
}

// The parser would only report a missing command. Empty if there is nothing unknown.
std::string unknown_command(CLI::App& app, const Words& words) {
  const Named named = named_command(app, words);
  const std::vector<CLI::App*> next = commands_of(*named.command);
  const auto depth = std::count(named.words.begin(), named.words.end(), ' ');
  if (next.empty() || std::size_t(depth) == words.size()) return {};
  const std::string& word = words[std::size_t(depth)];
  if (word.empty() || word.front() == '-') return {};
  Words names;
  for (const CLI::App* each : next) names.push_back(each->get_name());
  return "unknown command '" + word + "'" + suggestion(word, names) + " (see " + named.words +
         " --help)";
}

// A variable that a script did not set would else pass for an option that was not given: without
// its --scene a path is free of all that stands there.
std::string empty_argument(const Words& words) {
  for (std::size_t k = 0; k < words.size(); ++k) {
    const bool is_named = words[k].starts_with("--") && words[k].ends_with('=');
    if (is_named) return words[k] + ": an argument is empty";
    if (words[k].empty()) return (k > 0 ? words[k - 1] + ": " : "") + "an argument is empty";
  }
  return {};
}

// For the first option that the command does not have; empty if none of its own is like it.
std::string option_suggestion(const CLI::App& command, const Words& words) {
  Words known;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
  }
  for (const std::string& word : words) {
    const std::string name = word.substr(0, word.find('='));
    if (!name.starts_with("--") || name.size() == 2) continue;
    if (std::find(known.begin(), known.end(), name) == known.end()) return suggestion(name, known);
  }
  return {};
}

ExitCode parse(CLI::App& app, Words words, const ExitCode& exit_code) {
  // `dyop help robot check` is `dyop robot check --help`.
  if (!words.empty() && words.front() == "help") {
    words.erase(words.begin());
    words.emplace_back("--help");
  }
  if (const std::string problem = unknown_command(app, words); !problem.empty()) {
    return report(ExitCode::BadInput, problem);
  }
  const Named named = named_command(app, words);
  if (const std::string problem = empty_argument(words); !problem.empty()) {
    return report(ExitCode::BadInput, problem + " (see " + named.words + " --help)");
  }
  try {
    app.parse(Words(words.rbegin(), words.rend()));  // takes the last one first
  } catch (const CLI::Success&) {                    // --help, --version
    throw;
  } catch (const CLI::ParseError& error) {
    std::string problem = error.what();
    if (error.get_exit_code() == int(CLI::ExitCodes::ExtrasError)) {
      problem += option_suggestion(*named.command, words);
    }
    return report(ExitCode::BadInput, problem + " (see " + named.words + " --help)");
  }
  return flushed(exit_code);
}

ExitCode run(CLI::App& app, int argc, char** argv, const ExitCode& exit_code) {
  try {
    return parse(app, Words(argv + 1, argv + argc), exit_code);
  } catch (const CLI::Success& request) {  // --help, --version
    app.exit(request);
    return flushed(ExitCode::Answered);
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
  dyop::cli::add_ray_command(app, exit_code);
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
