// SPDX-License-Identifier: BSD-3-Clause

// Runs the rigid scenes of [Ferguson2021] and lets CGAL look for bodies that intersect:
// outside_rigid_scenes [END [TIMES [SCENE...]]]. END: time at which a scene is ended, if it does
// not end before (default 0.02); TIMES: how many times within each step are looked at
// (default 4); SCENE: names of scenes, without them all. They are looked for in the folder that
// DYOP_EXTERNAL_DATA names; without it the program says so and returns 77 (skipped). The exit code
// is 1 if bodies intersect, energy is won, or a scene does not get to its end.
//
// Scenes in which forces or given motions do work may gain energy.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "dyop/core/error.h"
#include "dyop/io/recording.h"
#include "dyop/io/recording_lines.h"
#include "dyop/io/run_summary.h"
#include "dyop/io/scene_file.h"
#include "support/oracles/recording_oracle.h"
#include "support/world_energy.h"

namespace dyop::testing {
namespace {

namespace fs = std::filesystem;

constexpr int kSkipped = 77;

struct Outcome {
  RunTotals totals;
  Scalar largest_gain = 0;  // of energy, over that at the start and of falling a length of one
  double seconds = 0;
};

Outcome run(const Scene& scene, const fs::path& recording) {
  World world = make_world(scene);
  RecordingWriter recorder(recording, run_header(scene), {.pairs = PairDetail::None});
  Scalar weight = 0;
  for (const BodyDefinition& body : scene.bodies) {
    if (body.kind == BodyKind::Dynamic) weight += body.mass_properties.mass;
  }
  weight *= scene.options.gravity_W.norm();
  const Scalar begin = energy(world, scene.options.gravity_W);
  const Scalar scale = world.kinetic_energy() + weight;
  Outcome outcome;
  const auto clock = std::chrono::steady_clock::now();
  bool goes_on = true;
  while (goes_on && world.time() < scene.end_time) {
    const AdvanceReport report = world.advance(std::min(scene.step, scene.end_time - world.time()));
    recorder.write(report, world);
    outcome.totals.add(report);
    const Scalar gain = (energy(world, scene.options.gravity_W) - begin) / scale;
    outcome.largest_gain = std::max(outcome.largest_gain, gain);
    goes_on = report.status == AdvanceStatus::Completed;
  }
  recorder.finish();
  outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - clock).count();
  return outcome;
}

bool is_driven(const Scene& scene) {
  return std::any_of(scene.bodies.begin(), scene.bodies.end(), [](const BodyDefinition& body) {
    return body.wrench || body.kind == BodyKind::Kinematic;
  });
}

bool examine(const fs::path& file, Scalar end, int times_between) {
  const std::string name = file.stem().string();
  Scene scene = load_scene(file);
  scene.end_time = std::min(scene.end_time, end);
  const fs::path recording = fs::current_path() / ("outside-" + name + ".h5");
  const Outcome outcome = run(scene, recording);
  const RecordingReport report = check_recording(scene, RecordingReader(recording), times_between);
  fs::remove(recording);
  const bool is_complete = outcome.totals.status == AdvanceStatus::Completed;
  // literal: what hops at rest win, far below what a wrong impact law would.
  const bool is_sound = is_driven(scene) || outcome.largest_gain < 1e-4;
  for (const std::string& fault : report.faults) std::printf("%s\n", fault.c_str());
  std::printf("%-20s %-15s %6.3f %8lld %8lld %8lld %7zu %8.1e %8.2f\n", name.c_str(),
              std::string(outcome.totals.end()).c_str(), outcome.totals.t,
              static_cast<long long>(outcome.totals.impacts), static_cast<long long>(report.steps),
              static_cast<long long>(report.poses), report.faults.size(), outcome.largest_gain,
              outcome.seconds);
  std::fflush(stdout);
  return is_complete && is_sound && report.faults.empty();
}

int run_all(Scalar end, int times_between, const std::set<std::string>& chosen) {
  const char* data = std::getenv("DYOP_EXTERNAL_DATA");
  const fs::path folder = fs::path(data == nullptr ? "" : data) / "rigid-ipc";
  if (data == nullptr || !fs::is_directory(folder)) {
    std::printf("skipped: DYOP_EXTERNAL_DATA names no folder that holds rigid-ipc\n");
    return kSkipped;
  }
  std::vector<fs::path> files;
  for (const char* kind : {"scenes", "contact-scenes"}) {
    if (!fs::is_directory(folder / kind)) continue;
    for (const auto& entry : fs::directory_iterator(folder / kind)) {
      if (entry.path().extension() != ".json") continue;
      if (chosen.empty() || chosen.contains(entry.path().stem().string())) {
        files.push_back(entry.path());
      }
    }
  }
  std::sort(files.begin(), files.end());
  if (files.size() < std::max<std::size_t>(1, chosen.size())) {
    throw std::runtime_error("not all scenes asked for are in " + folder.string());
  }
  std::printf("%-20s %-15s %6s %8s %8s %8s %7s %8s %8s\n", "scene", "end", "time", "impacts",
              "steps", "poses", "faults", "gain", "seconds");
  bool is_good = true;
  for (const fs::path& file : files) {
    is_good &= examine(file, end, times_between);
  }
  return is_good ? 0 : 1;
}

}  // namespace
}  // namespace dyop::testing

int main(int count, char** arguments) {
  try {
    const double end = count > 1 ? std::atof(arguments[1]) : 0.02;
    const int times_between = count > 2 ? std::atoi(arguments[2]) : 4;
    if (!(end > 0) || times_between < 0)
      throw std::runtime_error("expected END > 0 and TIMES >= 0");
    const std::set<std::string> chosen(arguments + std::min(count, 3), arguments + count);
    return dyop::testing::run_all(end, times_between, chosen);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "outside_rigid_scenes: %s\n", error.what());
    return 2;
  }
}
