// SPDX-License-Identifier: BSD-3-Clause

// Ticks of a tool session: the scene of `dyop tool`, one tick after the other, and between them
// FCL's distance of the same instrument from the liver as it stands at the start:
//   haptic_session_benchmark SCENE.json [TICKS [DEADLINE in us]]

#include <cstdio>
#include <cstdlib>
#include <vector>

#include "dyop/io/haptic_scene_file.h"
#include "mesh_pair.h"

namespace dyop::testing {
namespace {

// All parts at their places while the jaws are closed.
TriangleMesh instrument(const HapticScene& scene) {
  std::vector<Vector3> vertices;
  std::vector<TriangleIndices> triangles;
  for (const ToolPart& part : scene.tool) {
    const auto& mesh = static_cast<const TriangleMesh&>(*part.shape);
    const auto first = std::int32_t(vertices.size());
    for (const Vector3& p : mesh.vertices()) vertices.push_back(part.X_TP * p);
    for (const TriangleIndices& t : mesh.triangles()) {
      triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
  }
  return TriangleMesh(std::move(vertices), std::move(triangles));
}

void print_row(const char* name, const std::vector<Scalar>& times) {
  std::printf("%-28s", name);
  for (const Scalar part : {0.5, 0.99, 0.999, 1.0}) std::printf(" %8.1f", quantile(times, part));
  std::printf("\n");
}

int run(const char* scene, std::int64_t ticks, std::int64_t deadline_us) {
  HapticRun run = load_haptic_run(scene);
  if (ticks > 0) run.runner.ticks = ticks;
  if (deadline_us > 0) run.runner.deadline = std::chrono::microseconds(deadline_us);
  run.runner.is_paced = false;

  const ToolObstacle& liver = run.scene.obstacles[0];
  const auto fcl_tool = fcl_model<FclRss>(instrument(run.scene));
  const auto fcl_liver = fcl_model<FclRss>(TriangleMesh(liver.vertices, liver.triangles));

  HapticSession session(run.scene, run.options);
  std::vector<Scalar> latencies, busy, work, fcl_times;
  Scalar started = 0;
  std::int64_t cut_off = 0, queries = 0, solves = 0;
  run_session(
      session,
      [&](std::int64_t tick) {
        const DevicePose device = run.device(tick);
        started = processor_time();
        return device;
      },
      run.tissue,
      [&](const TickRecord& record) {
        busy.push_back(processor_time() - started);
        latencies.push_back(Scalar(record.tick.latency.count()) / 1e3);
        work.push_back(Scalar(record.tick.statistics.work));
        cut_off += record.tick.cutoff.has_value();
        queries += record.tick.statistics.impact_queries;
        solves += record.tick.statistics.solves;
        if (record.number % 100 != 0) return;
        const RigidPose& X_WT = record.tick.tool.X_WT;
        fcl_times.push_back(
            microseconds([&] { fcl_distance(fcl_liver, RigidPose(), fcl_tool, X_WT); }));
      },
      run.runner);
  const auto count = double(latencies.size());
  std::printf("%.0f ticks, %.2f %% cut off, %.2f impact queries and %.2f solves a tick\n", count,
              100 * double(cut_off) / count, double(queries) / count, double(solves) / count);
  std::printf("%-28s %8s %8s %8s %8s\n", "us", "median", "99 %", "99.9 %", "worst");
  print_row("tick", latencies);
  print_row("tick, processor time", busy);
  print_row("tick, pieces of work", work);
  print_row("FCL distance from the liver", fcl_times);
  std::printf("median tick / median FCL distance: %.3f\n",
              quantile(busy, 0.5) / quantile(fcl_times, 0.5));
  return 0;
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  if (argc >= 2) {
    return dyop::testing::run(argv[1], argc > 2 ? std::atoll(argv[2]) : 0,
                              argc > 3 ? std::atoll(argv[3]) : 0);
  }
  std::fprintf(stderr, "usage: haptic_session_benchmark SCENE.json [TICKS [DEADLINE_US]]\n");
  return 2;
}
