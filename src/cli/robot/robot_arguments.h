// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "cli/commands.h"
#include "dyop/io/robot_file.h"

/// What the commands of `dyop robot` share.
namespace dyop::cli {

struct RobotArguments {
  std::string urdf;
  std::string srdf;
  std::vector<std::string> package_paths;
  std::string base = "fixed";
  bool trusts_never = false;
};

void add_robot_options(CLI::App& command, RobotArguments& arguments);

/// The robot; what the reader had to assume goes to stderr.
Robot load_from(const RobotArguments& arguments);

void add_robot_check(CLI::App& robot, ExitCode& exit_code);

}  // namespace dyop::cli
