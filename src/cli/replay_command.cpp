// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>
#include <nlohmann/json.hpp>

#include "cli/body_arguments.h"
#include "cli/commands.h"
#include "cli/picture/query_picture.h"
#include "dyop/io/query_record.h"
#include "dyop/io/result_text.h"
#include "dyop/toi/time_of_impact.h"

namespace dyop::cli {
namespace {

constexpr const char* kReplayExamples =
    R"(Repeats the query of a record (dyop toi --record FILE) and compares the results bit by bit.
Exit code 0: the same; 1: different, every field that differs is listed; 2: no readable record.

Examples:
  Record a query and repeat it:
    dyop toi sphere:0.5 box:1,1,1 --position-a -3 0 0 --velocity-a 4 0 0 --record query.json
    dyop replay query.json
  For a script:
    dyop replay query.json --json
  A picture of a query that failed (dyop-failure.json):
    dyop replay dyop-failure.json --picture failure.html
)";

struct ReplayArguments {
  std::string file;
  std::string picture_file;
  bool is_json = false;
};

// How the query ends now.
struct Outcome {
  std::optional<ToiResult> result;
  std::string failure;
};

Outcome ask_again(const ToiQuery& query) {
  try {
    return {
        time_of_impact(*query.a, *query.X_WA, *query.b, *query.X_WB, query.interval, query.options),
        ""};
  } catch (const std::exception& error) {
    return {std::nullopt, error.what()};
  }
}

std::vector<FieldDifference> compare(const QueryRecord& record, const Outcome& now) {
  std::vector<FieldDifference> differences;
  if (now.failure != record.failure()) {
    differences.push_back({"failure", record.failure(), now.failure});
  }
  if (now.result && record.failure().empty()) differences = record.differences(*now.result);
  return differences;
}

void print_json(const QueryRecord& record, const std::vector<FieldDifference>& differences) {
  nlohmann::ordered_json json;
  json["same"] = differences.empty();
  json["recorded_version"] = record.version();
  json["version"] = library_version();
  json["differences"] = nlohmann::ordered_json::array();
  for (const FieldDifference& difference : differences) {
    json["differences"].push_back(
        {{"field", difference.field}, {"recorded", difference.recorded}, {"now", difference.now}});
  }
  std::cout << json.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace) << '\n';
}

void print_text(const QueryRecord& record, const Outcome& now,
                const std::vector<FieldDifference>& differences) {
  if (now.result) std::cout << describe(*now.result);
  if (!now.failure.empty()) std::cout << "failure: " << now.failure << '\n';
  if (record.version() != library_version()) {
    std::cout << "recorded by dyop " << record.version() << ", this is " << library_version()
              << '\n';
  }
  if (differences.empty()) {
    std::cout << "the same as recorded, bit by bit\n";
    return;
  }
  std::cout << differences.size()
            << (differences.size() == 1 ? " field differs\n" : " fields differ\n");
  for (const FieldDifference& difference : differences) {
    std::cout << "  " << difference.field << "\n    recorded " << difference.recorded
              << "\n    now      " << difference.now << '\n';
  }
}

ExitCode run_replay(const ReplayArguments& arguments) {
  if (!arguments.picture_file.empty()) require_picture(arguments.picture_file);
  const QueryRecord record(input_file(arguments.file));
  const Outcome now = ask_again(record.query());
  const std::vector<FieldDifference> differences = compare(record, now);
  if (arguments.is_json) {
    print_json(record, differences);
  } else {
    print_text(record, now, differences);
  }
  // A query that fails has nothing to draw but its start.
  if (!arguments.picture_file.empty()) {
    ToiResult drawn = now.result.value_or(ToiResult{});
    if (!now.result) drawn.t_safe = record.query().interval.begin;
    write_picture(arguments.picture_file, toi_picture(record.query(), drawn));
  }
  return differences.empty() ? ExitCode::Answered : ExitCode::Different;
}

}  // namespace

void add_replay_command(CLI::App& app, ExitCode& exit_code) {
  auto arguments = std::make_shared<ReplayArguments>();
  CLI::App* command =
      app.add_subcommand("replay", "Repeat a recorded query and compare the results bit by bit");
  command->footer(kReplayExamples);
  command
      ->add_option("FILE", arguments->file,
                   "Record written by dyop toi --record; - is standard input")
      ->required();
  command->add_option("--picture", arguments->picture_file,
                      "Write a picture of the answer to a file .svg, .png or .html");
  command->add_flag("--json", arguments->is_json, "Print one JSON object to stdout");
  command->callback([arguments, &exit_code] { exit_code = run_replay(*arguments); });
}

}  // namespace dyop::cli
