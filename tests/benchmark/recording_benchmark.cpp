// SPDX-License-Identifier: BSD-3-Clause
// What recording adds to stepping: processor time with and without it, in turns, the least of each.
// Usage: recording_benchmark RUNS SCENE...      a scene file, or a kind of `dyop scene` and N:
// pile:200
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <optional>
#include <string>

#include "dyop/io/recording.h"
#include "dyop/io/recording_lines.h"
#include "dyop/io/scene_file.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

double processor_seconds() {
  return double(std::clock()) / CLOCKS_PER_SEC;
}

// All steps of a scene, and the recording's first and last writes; not reading the scene.
double seconds_of(const Scene& scene, const std::optional<std::filesystem::path>& recording) {
  World world = make_world(scene);
  const double begin = processor_seconds();
  std::optional<RecordingWriter> writer;
  if (recording) writer.emplace(*recording, run_header(scene));
  while (world.time() < scene.end_time) {
    const AdvanceReport report = world.advance(std::min(scene.step, scene.end_time - world.time()));
    if (writer) writer->write(report, world);
    if (report.status != AdvanceStatus::Completed) break;
  }
  if (writer) writer->finish();
  return processor_seconds() - begin;
}

void compare(const std::string& name, int runs, const testing::TemporaryDirectory& directory) {
  std::filesystem::path file = name;
  if (const std::size_t colon = name.find(':'); colon != std::string::npos) {
    file = directory.path() / "scene.json";
    const int n = std::stoi(name.substr(colon + 1));
    write_generated_scene(generate_scene(name.substr(0, colon), n), file);
  }
  Scene scene = load_scene(file, {"/usr/share/glmark2/models"});
  scene.options.thread_count = 1;
  const auto recording = directory.path() / "run.h5";
  double without = 1e9;
  double with = 1e9;
  for (int k = 0; k < runs; ++k) {
    without = std::min(without, seconds_of(scene, std::nullopt));
    with = std::min(with, seconds_of(scene, recording));
  }
  std::printf("| %s | %.0f | %.3f s | %.1f %% | %.1f MB |\n",
              std::filesystem::path(name).stem().c_str(), scene.end_time / scene.step, without,
              100 * (with / without - 1), double(std::filesystem::file_size(recording)) / 1e6);
  std::fflush(stdout);
}

}  // namespace
}  // namespace dyop

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: recording_benchmark RUNS SCENE...\n");
    return 1;
  }
  const dyop::testing::TemporaryDirectory directory;
  std::printf("| scene | steps | stepping | recording adds | file |\n|---|---|---|---|---|\n");
  for (int k = 2; k < argc; ++k) dyop::compare(argv[k], std::stoi(argv[1]), directory);
}
