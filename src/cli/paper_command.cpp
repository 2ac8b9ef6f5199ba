// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <filesystem>
#include <iostream>

#include "cli/commands.h"
#include "dyop/core/error.h"
#include "dyop/io/file_error.h"
#include "dyop/paper/published_dyop.h"
#include "io/file_bytes.h"
#include "paper/experiment/paper_experiment.h"

namespace dyop::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPaperExamples =
    R"(DIR gets paper.md (tables), times.csv, tests.csv, the paper's figures 4 and 5 in 2D and 3D, at rest
and moving (times-*.svg, gains-*.svg), and its construction (construction-*.svg): of one test where the
published rule is right and one where it is wrong, or of the pair given by --pair.

Examples:
  The whole experiment, a few seconds on an idle machine:
    dyop paper --out paper
  The construction for Obj3 moved against Obj7, with few repetitions:
    dyop paper --out paper --pair 3,7 --repetitions 5
)";

struct PaperArguments {
  std::string out;
  std::vector<int> pair;
  PaperSettings settings;
  bool is_json = false;
};

void write_file(const fs::path& directory, const std::string& name, const std::string& text) {
  io_internal::write_whole_file(directory / name, text);
}

std::string name_of(int dimension) {
  return std::to_string(dimension) + "d";
}

template <int dimension>
bool is_right(const PaperTest<dimension>& test) {
  return published_dyop(test.pair.a, test.pair.b).distance <= kPaperGap + kWrongBy;
}

template <int dimension>
void write_drawings(const PaperArguments& arguments, const fs::path& directory) {
  const auto tests = make_paper_tests<dimension>(arguments.settings.seed);
  const auto draw_first = [&](auto is_wanted) {
    const auto test = std::find_if(tests.begin(), tests.end(), is_wanted);
    if (test == tests.end()) return;
    write_file(directory,
               "construction-" + name_of(dimension) + "-" + std::to_string(test->object) + "-" +
                   std::to_string(test->against) + ".svg",
               draw_construction(*test));
  };
  if (!arguments.pair.empty()) {
    draw_first([&](const PaperTest<dimension>& test) {
      return test.object == arguments.pair[0] && test.against == arguments.pair[1];
    });
    return;
  }
  draw_first([](const PaperTest<dimension>& test) { return is_right(test); });
  draw_first([](const PaperTest<dimension>& test) { return !is_right(test); });
}

void check(const PaperArguments& arguments) {
  if (arguments.pair.empty()) return;
  DYOP_REQUIRE(arguments.pair.size() == 2 && arguments.pair[0] != arguments.pair[1],
               "--pair needs two different objects");
  for (const int object : arguments.pair) {
    DYOP_REQUIRE(object >= 1 && object <= kObjectCount, "--pair: objects are 1 to ", kObjectCount,
                 ", not ", object);
  }
}

ExitCode run_paper(const PaperArguments& arguments) {
  check(arguments);
  const fs::path directory = arguments.out;
  std::error_code error;
  fs::create_directories(directory, error);
  if (error) throw FileError(directory, "could not be created: " + error.message());
  write_drawings<2>(arguments, directory);
  write_drawings<3>(arguments, directory);
  const PaperResults results = run_paper_experiment(arguments.settings);
  write_file(directory, "paper.md", describe_paper(results));
  write_file(directory, "times.csv", paper_times_csv(results));
  write_file(directory, "tests.csv", paper_tests_csv(results));
  for (const PaperSeries& series : results.series) {
    const std::string kind = name_of(series.dimension) + (series.is_moving ? "-moving" : "");
    write_file(directory, "times-" + kind + ".svg", draw_times(series, arguments.settings));
    write_file(directory, "gains-" + kind + ".svg", draw_gains(series, arguments.settings));
  }
  std::cout << (arguments.is_json ? paper_json(results) + "\n" : describe_paper(results));
  return ExitCode::Answered;
}

}  // namespace

void add_paper_command(CLI::App& app, ExitCode& exit_code) {
  auto arguments = std::make_shared<PaperArguments>();
  CLI::App* command = app.add_subcommand("paper", "Repeat the experiment of the DyOP paper");
  command->footer(kPaperExamples);
  command->add_option("-o,--out", arguments->out, "Directory for tables and figures")->required();
  command->add_option("--pair", arguments->pair, "Objects I,J whose construction to draw")
      ->delimiter(',');
  command->add_option("--seed", arguments->settings.seed, "Seed of all random input")
      ->capture_default_str();
  command
      ->add_option("--repetitions", arguments->settings.repetitions,
                   "Timed batches per object and algorithm")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command
      ->add_option("--error-pairs", arguments->settings.error_pairs,
                   "Random pairs per row of the error table")
      ->check(CLI::Range(1, 100000000))
      ->capture_default_str();
  command->add_flag("--json", arguments->is_json, "Print one JSON object to stdout");
  command->callback([arguments, &exit_code] { exit_code = run_paper(*arguments); });
}

}  // namespace dyop::cli
