// SPDX-License-Identifier: BSD-3-Clause
#include <chrono>
#include <cmath>
#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>

#include "cli/body_arguments.h"
#include "cli/commands.h"
#include "cli/console.h"
#include "cli/recording/recording_tools.h"
#include "cli/scene_run.h"
#include "dyop/io/file_error.h"
#include "dyop/io/result_text.h"
#include "dyop/io/run_summary.h"
#include "dyop/io/scene_file.h"
#include "io/file_bytes.h"

namespace dyop::cli {
namespace {

constexpr const char* kSimulateExamples =
    R"(Prints a summary. -o FILE.h5 records the exact motions and all that happened, in HDF5, readable while
the run goes on and after a kill (docs/formats.md). Without it nothing is kept.
Meshes are looked for beside the scene, then in --mesh-path, then in the directories of the
environment variable DYOP_MESH_PATH (separated by colons). Ctrl-C ends with what is proven by then.

Examples:
  A bunny is thrown at another one; the mesh comes with the Debian package glmark2-data:
    dyop simulate examples/scenes/bunny-throw.json -o run.h5 --mesh-path /usr/share/glmark2/models
  The same in a script, on one core, exit code 1 if anything touches:
    dyop simulate scene.json --threads 1 --no-progress --json --fail-on-impact
  The recording as a page for the browser, and as text:
    dyop view run.h5 -o run.html
    dyop info run.h5 --json-lines > run.jsonl
)";

struct SimulateArguments {
  std::string scene;
  std::string out;
  std::string pairs = "contacts";
  std::vector<std::string> mesh_path;
  int threads = 0;
  bool no_impulses = false;
  bool no_progress = false;
  bool is_json = false;
  bool fails_on_impact = false;
};

struct Run {
  RunTotals totals;
  std::vector<ImpactEvent> impacts;
  nlohmann::ordered_json bodies;  // final states
  std::exception_ptr failure;     // what ended the run, rethrown once its files are written
};

std::unique_ptr<RunOutput> make_output(const Scene& scene, const SimulateArguments& arguments) {
  if (arguments.out.empty()) return std::make_unique<RunOutput>();
  return make_hdf5_output(arguments.out, scene, arguments.pairs);
}

Run record(const Scene& scene, const SimulateArguments& arguments, const std::stop_token& stop) {
  World world = make_world(scene);
  const std::unique_ptr<RunOutput> output = make_output(scene, arguments);
  ProgressBar progress(!arguments.no_progress);
  Run run;
  std::string message;
  try {
    step_through(scene, stop, world, [&](const AdvanceReport& report) {
      output->write(report, world);
      run.totals.add(report);
      run.impacts.insert(run.impacts.end(), report.impacts.begin(), report.impacts.end());
      progress.update(world.time() / scene.end_time, std::int64_t(run.impacts.size()));
    });
  } catch (const FileError&) {  // the recording itself cannot be written
    throw;
  } catch (const Error& error) {
    message = error.what();
    run.failure = std::current_exception();
    run.totals.error = message;
  }
  run.failure ? output->fail(message) : output->finish();
  run.bodies = bodies_json(world);
  return run;
}

void print_json(const Run& run, const SimulateArguments& arguments, double seconds) {
  nlohmann::ordered_json json;
  json["status"] = run.totals.end();
  json["t"] = run.totals.t;
  json["impacts"] = run.totals.impacts;
  json["first_impact"] = nullptr;
  if (!run.impacts.empty()) json["first_impact"] = run.impacts.front().t;
  json["steps"] = run.totals.steps;
  json["stalls"] = run.totals.work.stalls;
  json["unconverged"] = run.totals.work.unconverged;
  json["residual"] = run.totals.work.residual;
  json["shortest_gap"] = nullptr;  // no bodies touched
  if (run.totals.work.shortest_gap < kInfinity) {
    json["shortest_gap"] = run.totals.work.shortest_gap;
  }
  json["contacts"] = run.totals.work.contacts;
  json["too_near"] = run.totals.too_near.size();
  json["bodies"] = run.bodies;
  json["node_pairs"] = run.totals.toi.node_pairs;
  json["seconds"] = seconds;
  const StepTimes& times = run.totals.times;
  json["step_seconds"] = {{"total", times.total},   {"broad_phase", times.broad_phase},
                          {"flight", times.flight}, {"contacts", times.contacts},
                          {"solve", times.solve},   {"ends", times.ends},
                          {"proofs", times.proofs}};
  json["recording"] = nullptr;
  if (!arguments.out.empty()) json["recording"] = arguments.out;
  std::cout << json.dump() << '\n';
}

ExitCode exit_code_of(const Run& run, const SimulateArguments& arguments) {
  switch (run.totals.status) {
    case AdvanceStatus::Completed:
    case AdvanceStatus::StoppedAtImpact:
      return run.impacts.empty() ? ExitCode::Answered
                                 : exit_code_of_impact(arguments.fails_on_impact);
    case AdvanceStatus::NotRun:
    case AdvanceStatus::BudgetExhausted:
    case AdvanceStatus::NumericalLimit:
    case AdvanceStatus::Blocked:
    case AdvanceStatus::Cancelled:
      return ExitCode::Undecided;
  }
  return ExitCode::Undecided;
}

// Rethrows what ended a run, with the name of the scene.
[[noreturn]] void throw_named(const std::exception_ptr& failure, const std::string& scene) {
  try {
    std::rethrow_exception(failure);
  } catch (const IntegrationError& error) {
    throw IntegrationError(scene + ": " + error.what());
  } catch (const InvalidArgument& error) {  // a value that proves too large only during the run
    throw FileError(scene, error.what());
  }
}

ExitCode run_simulate(const SimulateArguments& arguments) {
  const InterruptGuard interrupt;
  const auto begin = std::chrono::steady_clock::now();
  require_recording_name(arguments.out);
  io_internal::require_other_than(arguments.out, {arguments.scene});
  std::vector<std::filesystem::path> directories = mesh_directories(arguments.mesh_path);
  if (arguments.scene == "-") directories.emplace_back(".");
  Scene scene = load_scene(input_file(arguments.scene), directories);
  scene.options.thread_count = arguments.threads;
  scene.options.measures_time = true;
  scene.options.records_impulses = !arguments.out.empty() && !arguments.no_impulses;
  const Run run = record(scene, arguments, interrupt.token());

  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (arguments.is_json) {
    print_json(run, arguments, seconds);
  } else {
    write_summary(std::cout, scene, run.impacts, run.totals, seconds);
  }
  if (run.failure) throw_named(run.failure, arguments.scene);
  return exit_code_of(run, arguments);
}

}  // namespace

void add_simulate_command(CLI::App& app, ExitCode& exit_code) {
  auto arguments = std::make_shared<SimulateArguments>();
  CLI::App* command = app.add_subcommand("simulate", "Step a scene, and record the run");
  command->footer(kSimulateExamples);
  command
      ->add_option("SCENE", arguments->scene, "Scene file (docs/formats.md); - is standard input")
      ->required();
  command->add_option("-o,--out", arguments->out, "Recording to write, FILE.h5");
  command
      ->add_option("--pairs", arguments->pairs,
                   "What of near pairs goes into the recording after each step")
      ->check(CLI::IsMember({"none", "gaps", "contacts"}))
      ->capture_default_str();
  command->add_flag("--no-impulses", arguments->no_impulses,
                    "Leave out the impulses, which dyop check needs for its contact layer");
  command->add_option("--mesh-path", arguments->mesh_path, "More directories to search for meshes");
  command
      ->add_option("--threads", arguments->threads,
                   "0: one per core; the result is always the same")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  command->add_flag("--no-progress", arguments->no_progress, "No progress bar on a terminal");
  command->add_flag("--json", arguments->is_json,
                    "Print one JSON object to stdout instead of the summary");
  command->add_flag("--fail-on-impact", arguments->fails_on_impact, "Exit code 1 if bodies met");
  command->callback([arguments, &exit_code] { exit_code = run_simulate(*arguments); });
}

}  // namespace dyop::cli
