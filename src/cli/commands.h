// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>

namespace dyop::cli {

/// Exit codes of the process; documented in docs/command-line.md and in `dyop --help`.
enum class ExitCode {
  Answered = 0,   ///< the question was answered, whatever the answer
  Impact = 1,     ///< with --fail-on-impact: the answer is an impact or an overlap
  Different = 1,  ///< replay: the answer is not the recorded one
  BadInput = 2,   ///< a file, an option or a value cannot be used
  Undecided = 3,  ///< a budget, a limit or the user ended the work first
  Internal = 4,   ///< an error in dyop
};

/// Each adds one command that stores its exit code in `exit_code`, which must outlive the app.
void add_check_command(CLI::App& app, ExitCode& exit_code);
void add_distance_command(CLI::App& app, ExitCode& exit_code);
void add_export_command(CLI::App& app, ExitCode& exit_code);
void add_info_command(CLI::App& app, ExitCode& exit_code);
void add_paper_command(CLI::App& app, ExitCode& exit_code);
void add_ray_command(CLI::App& app, ExitCode& exit_code);
void add_replay_command(CLI::App& app, ExitCode& exit_code);
void add_robot_command(CLI::App& app, ExitCode& exit_code);
void add_scene_command(CLI::App& app, ExitCode& exit_code);
void add_simulate_command(CLI::App& app, ExitCode& exit_code);
void add_study_command(CLI::App& app, ExitCode& exit_code);
void add_toi_command(CLI::App& app, ExitCode& exit_code);
void add_view_command(CLI::App& app, ExitCode& exit_code);
void add_tool_command(CLI::App& app, ExitCode& exit_code);

/// Exit code of a command that found an impact or an overlap.
inline ExitCode exit_code_of_impact(bool fails_on_impact) {
  return fails_on_impact ? ExitCode::Impact : ExitCode::Answered;
}

}  // namespace dyop::cli
