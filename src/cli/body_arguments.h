// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dyop/geometry/shape.h"
#include "dyop/io/mesh_file.h"
#include "dyop/motion/motion.h"

namespace dyop::cli {

/// The command line's arguments for one of two bodies; `side` is "a" or "b".
struct BodyArguments {
  explicit BodyArguments(std::string the_side) : side(std::move(the_side)) {}

  std::string side;
  std::string shape;  ///< file, or sphere:R, box:X,Y,Z, capsule:R,H
  std::vector<Scalar> position;
  std::vector<Scalar> quaternion;
  std::vector<Scalar> axis_angle;  ///< axis, then degrees
  std::vector<Scalar> velocity;
  std::vector<Scalar> spin;
  std::string motion_file;
  std::optional<Scalar> scale;  ///< overrides the placement's

  std::string option(const std::string& name) const { return "--" + name + "-" + side; }
};

/// How meshes are placed, unless overridden per body.
struct PlacementArguments {
  Scalar scale = 1;
  std::string center = "none";
};

/// Checks of an option's text for CLI::Option::check(): what is wrong, or empty. Unlike those of
/// CLI11 they reject NaN, and numbers too large to count with.
std::string require_count(const std::string& text);
std::string require_positive(const std::string& text);
std::string require_non_negative(const std::string& text);

void add_placement_options(CLI::App& app, PlacementArguments& placement);
void add_pose_options(CLI::App& app, BodyArguments& body);
void add_motion_options(CLI::App& app, BodyArguments& body);

/// @throws FileError, or InvalidArgument naming the argument.
std::shared_ptr<const Shape> make_shape(const std::string& text,
                                        const PlacementArguments& placement);
std::shared_ptr<const Shape> make_shape(const BodyArguments& body, PlacementArguments placement);
RigidPose make_pose(const BodyArguments& body);
std::shared_ptr<const Motion> make_motion(const BodyArguments& body);

/// Runs f; prefixes an InvalidArgument from it with the name of the option.
template <typename Function>
auto guard_option(const std::string& option, Function f) {
  try {
    return f();
  } catch (const InvalidArgument& error) {
    throw InvalidArgument(option + ": " + error.what());
  }
}

/// The directories of --mesh-path, then those of the environment variable DYOP_MESH_PATH.
std::vector<std::filesystem::path> mesh_directories(const std::vector<std::string>& mesh_path);

/// The file that a name on the command line stands for: - is standard input.
inline std::filesystem::path input_file(const std::string& name) {
  return name == "-" ? "/dev/stdin" : name;
}

}  // namespace dyop::cli
