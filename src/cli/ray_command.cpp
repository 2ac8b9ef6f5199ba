// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>

#include "cli/body_arguments.h"
#include "cli/commands.h"
#include "dyop/core/error.h"
#include "dyop/distance/ray_cast.h"
#include "dyop/io/result_text.h"

namespace dyop::cli {
namespace {

constexpr const char* kRayExamples =
    R"(The shape is a mesh file or a primitive, as for dyop distance.

Examples:
  Where does a ray from (0, 0, 5) straight down meet a bunny?
    dyop ray bunny.obj --from 0 0 5 --direction 0 0 -1
  How far can a ball of radius 0.2 go along x before it touches a box?
    dyop ray box:1,1,1 --position-a 4 0 0 --from 0 0 0 --direction 1 0 0 --radius 0.2 --json
)";

struct RayArguments {
  BodyArguments a{"a"};
  PlacementArguments placement;
  std::vector<Scalar> from;
  std::vector<Scalar> direction;
  Ray ray;
  bool is_json = false;
  bool fails_on_impact = false;
};

ExitCode run_ray(const RayArguments& arguments) {
  Ray ray = arguments.ray;
  ray.p_W = {arguments.from[0], arguments.from[1], arguments.from[2]};
  ray.direction_W = {arguments.direction[0], arguments.direction[1], arguments.direction[2]};
  const auto shape = make_shape(arguments.a, arguments.placement);
  const RayHit hit = ray_cast(*shape, make_pose(arguments.a), ray);
  if (arguments.is_json) {
    std::cout << to_json_text(hit) << '\n';
  } else {
    std::cout << describe(hit);
  }
  if (hit.status == RayStatus::Miss) return ExitCode::Answered;
  if (hit.status == RayStatus::NumericalLimit) return ExitCode::Undecided;
  return exit_code_of_impact(arguments.fails_on_impact);
}

}  // namespace

void add_ray_command(CLI::App& app, ExitCode& exit_code) {
  auto arguments = std::make_shared<RayArguments>();
  CLI::App* command = app.add_subcommand("ray", "Where a ray, or a ball on it, meets a shape");
  command->footer(kRayExamples);
  command->add_option("A", arguments->a.shape, "Shape")->required();
  command->add_option("--from", arguments->from, "Start: x y z")->expected(3)->required();
  command->add_option("--direction", arguments->direction, "Direction of any length: x y z")
      ->expected(3)
      ->required();
  command->add_option("--length", arguments->ray.length, "How far it goes; default: for ever");
  command->add_option("--radius", arguments->ray.radius, "Radius of the ball; default 0: a ray");
  add_placement_options(*command, arguments->placement);
  add_pose_options(*command, arguments->a);
  command->add_flag("--json", arguments->is_json, "Print one JSON object to stdout");
  command->add_flag("--fail-on-impact", arguments->fails_on_impact, "Exit code 1 if it hits");
  command->callback([arguments, &exit_code] { exit_code = run_ray(*arguments); });
}

}  // namespace dyop::cli
