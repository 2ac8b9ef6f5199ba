// SPDX-License-Identifier: BSD-3-Clause
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/commands.h"
#include "cli/interrupt.h"
#include "cli/progress_bar.h"
#include "dyop/io/file_error.h"
#include "dyop/io/result_text.h"
#include "dyop/scene_io/run_recording.h"
#include "dyop/scene_io/run_summary.h"
#include "dyop/scene_io/scene_file.h"

namespace dyop::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSimulateExamples =
    R"(DIR gets recording.jsonl, with every proven step and impact, and summary.txt, for people.
Meshes are looked for beside the scene, then in --mesh-path, then in the directories of the
environment variable DYOP_MESH_PATH (separated by colons). Ctrl-C ends with what is proven by then.

Examples:
  A bunny is thrown at another one; the mesh comes with the Debian package glmark2-data:
    dyop simulate examples/scenes/bunny-throw.json --out run --mesh-path /usr/share/glmark2/models
  The same in a script, on one core, exit code 1 if anything touches:
    dyop simulate scene.json --out run --threads 1 --no-progress --json --fail-on-impact
)";

struct SimulateArguments {
  std::string scene;
  std::string out;
  std::vector<std::string> mesh_path;
  int threads = 0;
  bool no_progress = false;
  bool is_json = false;
  bool fails_on_impact = false;
};

struct Run {
  RunTotals totals;
  std::vector<ImpactEvent> impacts;
  nlohmann::ordered_json bodies;  // where they ended
  std::exception_ptr failure;     // what ended it, to be thrown once its files are written
};

std::vector<fs::path> mesh_directories(const SimulateArguments& arguments) {
  std::vector<fs::path> directories(arguments.mesh_path.begin(), arguments.mesh_path.end());
  if (const char* variable = std::getenv("DYOP_MESH_PATH")) {
    std::istringstream list(variable);
    for (std::string directory; std::getline(list, directory, ':');) {
      if (!directory.empty()) directories.emplace_back(directory);
    }
  }
  return directories;
}

std::ofstream open_file(const fs::path& file) {
  std::ofstream out(file, std::ios::binary);
  if (!out) throw FileError(file, "cannot be written");
  return out;
}

void close_file(std::ofstream& out, const fs::path& file) {
  out.close();
  if (!out) throw FileError(file, "cannot be written to its end");
}

// A rest shorter than this part of a step is no step of its own.
// literal: only rounding of end / step makes such a rest
constexpr Scalar kNoStep = 1e-6;

// What a run needs beside its scene and its results.
struct Watch {
  const std::stop_token& stop;
  ProgressBar& progress;
};

void step_through(const Scene& scene, const Watch& watch, World& world, RunRecorder& recorder,
                  std::vector<ImpactEvent>& impacts) {
  const auto count =
      std::max<std::int64_t>(1, std::llround(std::ceil(scene.end_time / scene.step - kNoStep)));
  for (std::int64_t k = 1; k <= count; ++k) {
    const Scalar t = k == count ? scene.end_time : Scalar(k) * scene.step;
    const AdvanceReport report = world.advance(t - world.time(), {watch.stop, std::nullopt});
    recorder.write(report);
    impacts.insert(impacts.end(), report.impacts.begin(), report.impacts.end());
    watch.progress.update(world.time() / scene.end_time, std::int64_t(impacts.size()));
    if (report.status != AdvanceStatus::Completed) return;
  }
}

nlohmann::ordered_json bodies_json(const World& world) {
  const auto numbers = [](const auto& v) { return std::vector<Scalar>(v.begin(), v.end()); };
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const BodyId id : world.bodies()) {
    const MotionState state = world.state(id);
    const Quaternion q = state.X_WB.quaternion();
    nlohmann::ordered_json body;
    body["name"] = world.body(id).name;
    body["position"] = numbers(state.X_WB.translation());
    body["quaternion"] = std::vector<Scalar>{q.w(), q.x(), q.y(), q.z()};
    body["linear_velocity"] = numbers(state.twist.v_WB);
    body["angular_velocity"] = numbers(state.twist.w_WB);
    body["asleep"] = world.is_asleep(id);
    list.push_back(std::move(body));
  }
  return list;
}

Run record(const Scene& scene, const fs::path& file, const SimulateArguments& arguments,
           const std::stop_token& stop) {
  World world = make_world(scene);
  std::ofstream out = open_file(file);
  RunRecorder recorder(out, scene);
  ProgressBar progress(!arguments.no_progress);
  Run run;
  try {
    step_through(scene, {stop, progress}, world, recorder, run.impacts);
    recorder.finish();
  } catch (const Error& error) {
    recorder.fail(error.what());
    run.failure = std::current_exception();
  }
  close_file(out, file);
  run.bodies = bodies_json(world);
  run.totals = recorder.totals();
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
                          {"solve", times.solve},   {"proofs", times.proofs}};
  json["recording"] = (fs::path(arguments.out) / "recording.jsonl").string();
  json["summary"] = (fs::path(arguments.out) / "summary.txt").string();
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

// Throws what ended a run again, with the name of the scene.
[[noreturn]] void throw_named(const std::exception_ptr& failure, const std::string& scene) {
  try {
    std::rethrow_exception(failure);
  } catch (const IntegrationError& error) {
    throw IntegrationError(scene + ": " + error.what());
  } catch (const InvalidArgument& error) {  // a value that only shows to be too large in the run
    throw FileError(scene, error.what());
  }
}

ExitCode run_simulate(const SimulateArguments& arguments) {
  const InterruptGuard interrupt;
  const auto begin = std::chrono::steady_clock::now();
  Scene scene = load_scene(arguments.scene, mesh_directories(arguments));
  scene.options.thread_count = arguments.threads;
  scene.options.measures_time = true;
  const fs::path directory = arguments.out;
  std::error_code error;
  fs::create_directories(directory, error);
  if (error) throw FileError(directory, "cannot be made: " + error.message());
  const Run run = record(scene, directory / "recording.jsonl", arguments, interrupt.token());

  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  std::ostringstream summary;
  write_summary(summary, scene, run.impacts, run.totals, seconds);
  std::ofstream out = open_file(directory / "summary.txt");
  out << summary.str();
  close_file(out, directory / "summary.txt");
  if (arguments.is_json) {
    print_json(run, arguments, seconds);
  } else {
    std::cout << summary.str();
  }
  if (run.failure) throw_named(run.failure, arguments.scene);
  return exit_code_of(run, arguments);
}

}  // namespace

void add_simulate_command(CLI::App& app, ExitCode& exit_code) {
  auto arguments = std::make_shared<SimulateArguments>();
  CLI::App* command = app.add_subcommand("simulate", "Step a scene and record what happens");
  command->footer(kSimulateExamples);
  command->add_option("SCENE", arguments->scene, "Scene file (docs/scene-format.md)")->required();
  command->add_option("--out", arguments->out, "Directory for the results; created if missing")
      ->required();
  command->add_option("--mesh-path", arguments->mesh_path, "More directories to search for meshes");
  command
      ->add_option("--threads", arguments->threads,
                   "0: as many as the machine has; the result is the same")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  command->add_flag("--no-progress", arguments->no_progress, "No progress bar on a terminal");
  command->add_flag("--json", arguments->is_json,
                    "One JSON object on stdout instead of the summary");
  command->add_flag("--fail-on-impact", arguments->fails_on_impact, "Exit code 1 if bodies met");
  command->callback([arguments, &exit_code] { exit_code = run_simulate(*arguments); });
}

}  // namespace dyop::cli
