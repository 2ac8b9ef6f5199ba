// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>

#include "cli/body_arguments.h"
#include "cli/commands.h"
#include "cli/picture/query_picture.h"
#include "dyop/distance/distance.h"
#include "dyop/io/result_text.h"
#include "io/file_bytes.h"

namespace dyop::cli {
namespace {

constexpr const char* kDistanceExamples =
    R"(Shapes are mesh files, or sphere:RADIUS, box:HX,HY,HZ (half extents), capsule:RADIUS,HALFLENGTH,
cylinder:RADIUS,HALFLENGTH, cone:RADIUS,HALFLENGTH, half_space:NX,NY,NZ,OFFSET; others are in
docs/command-line.md.

Examples:
  How far is a ball of radius 0.5 at (3, 0, 0) from a box with edges 2, 2, 2?
    dyop distance sphere:0.5 box:1,1,1 --position-a 3 0 0
  Two bunnies side by side, the second one turned by 90 degrees about y, as JSON:
    dyop distance bunny.obj bunny.obj --position-b 2.5 0 0 --axis-angle-b 0 1 0 90 --json
)";

struct DistanceArguments {
  BodyArguments a{"a"};
  BodyArguments b{"b"};
  PlacementArguments placement;
  DistanceOptions options;
  std::string picture_file;
  bool is_json = false;
  bool fails_on_impact = false;
};

ExitCode run_distance(const DistanceArguments& arguments) {
  io_internal::require_other_than(arguments.picture_file, {arguments.a.shape, arguments.b.shape});
  if (!arguments.picture_file.empty()) require_picture(arguments.picture_file);
  const auto a = make_shape(arguments.a, arguments.placement);
  const auto b = make_shape(arguments.b, arguments.placement);
  const DistanceResult result =
      distance(*a, make_pose(arguments.a), *b, make_pose(arguments.b), arguments.options);
  if (arguments.is_json) {
    std::cout << to_json_text(result) << '\n';
  } else {
    std::cout << describe(result);
  }
  if (!arguments.picture_file.empty()) {
    write_picture(arguments.picture_file,
                  distance_picture(*a, make_pose(arguments.a), *b, make_pose(arguments.b), result));
  }
  if (result.status == DistanceStatus::Overlapping) {
    return exit_code_of_impact(arguments.fails_on_impact);
  }
  const bool is_decided = result.status == DistanceStatus::Separated ||
                          result.status == DistanceStatus::FartherThanMaxDistance;
  return is_decided ? ExitCode::Answered : ExitCode::Undecided;
}

}  // namespace

void add_distance_command(CLI::App& app, ExitCode& exit_code) {
  auto arguments = std::make_shared<DistanceArguments>();
  CLI::App* command = app.add_subcommand("distance", "Distance of two shapes, with proven bounds");
  command->footer(kDistanceExamples);
  command->add_option("A", arguments->a.shape, "First shape")->required();
  command->add_option("B", arguments->b.shape, "Second shape")->required();
  command->add_option("--max-distance", arguments->options.max_distance,
                      "Stop once the shapes are proven farther apart than this");
  command->add_option("--absolute-tolerance", arguments->options.absolute_tolerance,
                      "Allowed difference of the bounds");
  command->add_option("--relative-tolerance", arguments->options.relative_tolerance,
                      "The same, as a fraction of the distance, below 1");
  command->add_flag("--penetration", arguments->options.with_penetration,
                    "Also compute the depth of overlapping convex shapes");
  add_placement_options(*command, arguments->placement);
  add_pose_options(*command, arguments->a);
  add_pose_options(*command, arguments->b);
  command->add_flag("--solid-a", arguments->options.solid_a,
                    "Treat A as a solid: anything inside the closed mesh overlaps");
  command->add_flag("--solid-b", arguments->options.solid_b, "Treat B as a solid");
  command->add_option("--picture", arguments->picture_file,
                      "Write a picture of the answer to a file .svg, .png or .html");
  command->add_flag("--json", arguments->is_json, "Print one JSON object to stdout");
  command->add_flag("--fail-on-impact", arguments->fails_on_impact, "Exit code 1 if they overlap");
  command->callback([arguments, &exit_code] { exit_code = run_distance(*arguments); });
}

}  // namespace dyop::cli
