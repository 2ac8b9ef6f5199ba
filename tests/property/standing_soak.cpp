// SPDX-License-Identifier: BSD-3-Clause

// Steps a scene that should stand and prints how it does:
// standing_soak SCENE N H END [ROWS], SCENE a kind of generate_scene() with its N, or the name of a
// scene file (N is then ignored). ROWS: how many rows are printed (default 10). Columns: time, how
// many bodies are awake, the largest speed of a body (of its centre, and of turning times its
// radius), the largest way of a body from where it began and since the last row, both over the
// radius of the body, contacts, unconverged solves, largest residual, stalls, and the processor
// time of a step. The exit code is 1 if a step was not completed, an island stalled, or a body
// moved by more than a hundredth of its radius.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "dyop/io/scene_file.h"
#include "support/temporary_directory.h"

namespace dyop::testing {
namespace {

namespace fs = std::filesystem;

Scene scene_of(const std::string& name, int n) {
  if (fs::exists(name)) return load_scene(name);
  const TemporaryDirectory folder;
  const fs::path file = folder.path() / "scene.json";
  write_generated_scene(generate_scene(name, n), file);
  return load_scene(file);
}

// Largest displacement of a point of a body between two poses, over its radius.
Scalar way(const BodyDefinition& body, const RigidPose& X, const RigidPose& Y) {
  const Scalar radius = body.shape->bounding_radius();
  const Vector3& center = body.mass_properties.p_BoBcm;
  const Scalar turn = (X.rotation() - Y.rotation()).norm() / std::sqrt(Scalar{2});
  return (X * center - Y * center).norm() / radius + turn;
}

struct Row {
  Scalar fastest = 0;
  Scalar from_start = 0;
  Scalar from_last = 0;
  int awake = 0;
};

Row examine(const World& world, const std::vector<RigidPose>& start,
            const std::vector<RigidPose>& last) {
  Row row;
  for (const BodyId id : world.bodies()) {
    const BodyDefinition& body = world.body(id);
    if (body.kind != BodyKind::Dynamic) continue;
    const MotionState state = world.state(id);
    row.awake += !world.is_asleep(id);
    row.fastest =
        std::max(row.fastest,
                 state.twist.v_WB.norm() + state.twist.w_WB.norm() * body.shape->bounding_radius());
    row.from_start = std::max(row.from_start, way(body, start[id.slot], state.X_WB));
    row.from_last = std::max(row.from_last, way(body, last[id.slot], state.X_WB));
  }
  return row;
}

std::vector<RigidPose> poses_of(const World& world) {
  std::vector<RigidPose> poses;
  for (const BodyId id : world.bodies()) poses.push_back(world.state(id).X_WB);
  return poses;
}

int run(const std::string& name, int n, Scalar h, Scalar end, int rows) {
  Scene scene = scene_of(name, n);
  scene.options.records_motions = false;
  scene.options.thread_count = 1;
  World world = make_world(scene);
  const std::vector<RigidPose> start = poses_of(world);
  std::vector<RigidPose> last = start;
  StepStatistics work;
  std::clock_t clock = std::clock();
  bool is_good = true;
  const auto steps = std::lround(end / h);
  const long per_row = std::max(1L, steps / rows);
  std::printf("%8s %5s %9s %9s %9s %5s %5s %9s %5s %6s %9s\n", "t", "awake", "speed", "from start",
              "since row", "cont", "unc", "residual", "stall", "rounds", "ms/step");
  for (long k = 1; k <= steps; ++k) {
    const AdvanceReport report = world.advance(h);
    if (report.status != AdvanceStatus::Completed) {
      std::printf("t = %.4f: not completed\n", world.time());
      return 1;
    }
    work.contacts = std::max(work.contacts, report.work.contacts);
    work.unconverged += report.work.unconverged;
    work.residual = std::max(work.residual, report.work.residual);
    work.stalls += report.work.stalls;
    work.rounds += report.work.rounds;
    if (k % per_row != 0 && k != steps) continue;
    const Row row = examine(world, start, last);
    last = poses_of(world);
    const double ms = 1e3 * double(std::clock() - clock) / CLOCKS_PER_SEC / double(per_row);
    clock = std::clock();
    std::printf("%8.3f %5d %9.2e %9.2e %9.2e %5d %5d %9.2e %5d %6d %9.3f\n", world.time(),
                row.awake, row.fastest, row.from_start, row.from_last, int(work.contacts),
                int(work.unconverged), work.residual, int(work.stalls), int(work.rounds), ms);
    std::fflush(stdout);
    is_good = is_good && work.stalls == 0 && row.from_start < 0.01;
    work = {};
  }
  return is_good ? 0 : 1;
}

}  // namespace
}  // namespace dyop::testing

int main(int count, char** arguments) {
  try {
    if (count < 5) throw std::runtime_error("expected SCENE N H END [ROWS]");
    const int rows = count > 5 ? std::atoi(arguments[5]) : 10;
    return dyop::testing::run(arguments[1], std::atoi(arguments[2]), std::atof(arguments[3]),
                              std::atof(arguments[4]), std::max(rows, 1));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "standing_soak: %s\n", error.what());
    return 2;
  }
}
