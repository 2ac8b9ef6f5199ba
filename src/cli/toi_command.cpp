// SPDX-License-Identifier: BSD-3-Clause
#include <chrono>
#include <iostream>
#include <optional>

#include "cli/body_arguments.h"
#include "cli/commands.h"
#include "cli/console.h"
#include "cli/failure_record.h"
#include "cli/picture/query_picture.h"
#include "core/deadline.h"
#include "dyop/io/query_record.h"
#include "dyop/io/result_text.h"
#include "dyop/toi/time_of_impact.h"
#include "io/file_bytes.h"

namespace dyop::cli {
namespace {

constexpr const char* kToiExamples =
    R"(Shapes are mesh files, or sphere:RADIUS, box:HX,HY,HZ (half extents), capsule:RADIUS,HALFLENGTH,
cylinder:RADIUS,HALFLENGTH, cone:RADIUS,HALFLENGTH, half_space:NX,NY,NZ,OFFSET; others are in
docs/command-line.md.
Any consistent units. Without options both bodies rest at the origin; poses are those at time 0.

Examples:
  A ball flies at a wall:
    dyop toi sphere:0.5 box:0.1,5,5 --position-a -3 0 0 --velocity-a 1 0 0 --interval 0 10
  A turning bunny flies at another one; within 0.01 is an impact, JSON output for a script:
    dyop toi bunny.obj bunny.obj --position-b 4 0 0 --velocity-b -3 0 0 --spin-b 0 2 5 \
        --target 0.01 --json
  A picture of it, with the gap over time:
    dyop toi bunny.obj bunny.obj --position-b 4 0 0 --velocity-b -3 0 0 --picture impact.svg
)";

struct ToiArguments {
  BodyArguments a{"a"};
  BodyArguments b{"b"};
  PlacementArguments placement;
  std::vector<Scalar> interval{0, 1};
  ToiOptions options;
  std::optional<Scalar> tolerance;
  std::optional<Scalar> time_limit;
  std::string record_file;
  std::string picture_file;
  bool is_json = false;
  bool fails_on_impact = false;
};

ToiOptions make_options(const ToiArguments& arguments, const InterruptGuard& interrupt) {
  ToiOptions options = arguments.options;
  options.distance_tolerance = arguments.tolerance;
  if (arguments.time_limit) {
    options.deadline = core_internal::deadline_after(*arguments.time_limit);
  }
  options.stop = interrupt.token();
  return options;
}

ExitCode exit_code_of(const ToiResult& result, bool fails_on_impact) {
  switch (result.status) {
    case ToiStatus::Separated:
      return ExitCode::Answered;
    case ToiStatus::Impact:
    case ToiStatus::InitiallyWithinTarget:
      return exit_code_of_impact(fails_on_impact);
    case ToiStatus::NotRun:
    case ToiStatus::BudgetExhausted:
    case ToiStatus::Cancelled:
    case ToiStatus::NumericalLimit:
      return ExitCode::Undecided;
  }
  return ExitCode::Undecided;  // not reached
}

// A stop, or a limit on the time before the first step, leaves nothing that a replay could repeat.
// The answer is undecided all the same, not bad input.
void record_if_repeatable(const std::string& file, const ToiQuery& query, const ToiResult& result) {
  const bool is_unbegun =
      result.status == ToiStatus::BudgetExhausted && result.statistics.node_pairs == 0;
  if (is_unbegun || result.status == ToiStatus::Cancelled) {
    std::cerr << "dyop: note: " << file << ": not written, as a replay could not stop there\n";
  } else {
    write_query_record(file, query, result);
  }
}

ExitCode run_toi(const ToiArguments& arguments) {
  for (const std::string& file : {arguments.record_file, arguments.picture_file}) {
    io_internal::require_other_than(file, {arguments.a.shape, arguments.b.shape,
                                           arguments.a.motion_file, arguments.b.motion_file});
  }
  if (!arguments.picture_file.empty()) require_picture(arguments.picture_file);
  const InterruptGuard interrupt;
  const TimeInterval interval{arguments.interval[0], arguments.interval[1]};
  guard_option("--interval", [&] { require_valid(interval); });
  const auto X_WA = make_motion(arguments.a);
  const auto X_WB = make_motion(arguments.b);
  const auto a = make_shape(arguments.a, arguments.placement);
  const auto b = make_shape(arguments.b, arguments.placement);
  const ToiOptions options = make_options(arguments, interrupt);
  const auto begin = std::chrono::steady_clock::now();
  const ToiQuery query{a.get(), X_WA.get(), b.get(), X_WB.get(), interval, options};
  const ToiResult result = answer_or_record(query, arguments.record_file, [&] {
    return time_of_impact(*a, *X_WA, *b, *X_WB, interval, options);
  });
  const std::chrono::duration<double, std::milli> spent = std::chrono::steady_clock::now() - begin;
  if (arguments.is_json) {
    std::cout << to_json_text(result) << '\n';
  } else {
    std::cout << describe(result) << "  time spent   " << spent.count() << " ms\n";
  }
  // After the answer is printed, so that a failed record does not lose it.
  if (!arguments.record_file.empty()) {
    record_if_repeatable(arguments.record_file, query, result);
  }
  if (!arguments.picture_file.empty()) {
    write_picture(arguments.picture_file, toi_picture(query, result));
  }
  return exit_code_of(result, arguments.fails_on_impact);
}

}  // namespace

void add_toi_command(CLI::App& app, ExitCode& exit_code) {
  auto arguments = std::make_shared<ToiArguments>();
  CLI::App* command =
      app.add_subcommand("toi", "When two moving shapes first touch, or a proof that they do not");
  command->footer(kToiExamples);
  command->add_option("A", arguments->a.shape, "First shape")->required();
  command->add_option("B", arguments->b.shape, "Second shape")->required();
  command->add_option("--interval", arguments->interval, "Start and end of the time interval")
      ->expected(2)
      ->capture_default_str();
  command
      ->add_option("--target", arguments->options.target_distance,
                   "Gap at which the shapes count as touching")
      ->check(require_non_negative)
      ->capture_default_str();
  command
      ->add_option(
          "--tolerance", arguments->tolerance,
          "How far above the target an impact may be reported; default: a millionth of the "
          "smaller bounding radius")
      ->check(require_positive);
  command
      ->add_option("--max-node-pairs", arguments->options.max_node_pairs,
                   "Limit on the work, in pairs of tree nodes")
      ->check(require_count)
      ->capture_default_str();
  command->add_option("--time-limit", arguments->time_limit, "Limit on the time, in seconds")
      ->check(require_non_negative);
  add_placement_options(*command, arguments->placement);
  for (BodyArguments* body : {&arguments->a, &arguments->b}) {
    add_pose_options(*command, *body);
    add_motion_options(*command, *body);
  }
  command->add_flag("--contacts", arguments->options.with_contacts,
                    "Report all contacts at the impact, not only the first");
  command->add_flag("--solid-a", arguments->options.solid_a,
                    "Treat A as a solid: a part of B inside the closed mesh overlaps");
  command->add_flag("--solid-b", arguments->options.solid_b, "Treat B as a solid");
  command->add_option("--record", arguments->record_file,
                      "File to record the query and its answer in, for dyop replay");
  command->add_option("--picture", arguments->picture_file,
                      "Write a picture of the answer to a file .svg, .png or .html");
  command->add_flag("--json", arguments->is_json, "Print one JSON object to stdout");
  command->add_flag("--fail-on-impact", arguments->fails_on_impact, "Exit code 1 if they meet");
  command->callback([arguments, &exit_code] { exit_code = run_toi(*arguments); });
}

}  // namespace dyop::cli
