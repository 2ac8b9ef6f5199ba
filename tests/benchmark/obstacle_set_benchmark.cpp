// SPDX-License-Identifier: BSD-3-Clause

// One moving body against many obstacles: ObstacleSet beside a loop over the obstacles, the same
// queries. Counters: `hits` the share of impacts, `work` node pairs (or box tests) a query. The
// time is that of one query against all obstacles.

#include <benchmark/benchmark.h>

#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "dyop/geometry/primitives.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/obstacle_set.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop::testing {
namespace {

constexpr TimeInterval kSpan{0, 1};
constexpr std::size_t kQueries = 64;

// Obstacles of size 0.5 in a cube with space for 4^3 of them each, and queries that cross it by a
// quarter as they turn.
struct ManyObstacles {
  explicit ManyObstacles(std::int64_t count, bool are_meshes) {
    std::mt19937_64 random(7);
    const Scalar half = std::cbrt(Scalar(count));
    const auto box = std::make_shared<Box>(Vector3(0.25, 0.25, 0.25));
    const auto mesh = std::make_shared<TriangleMesh>(testing::torus(0.35, 0.15, 48, 24).mesh());
    for (std::int64_t i = 0; i < count; ++i) {
      const auto pose = random_pose(half, random);
      motions.push_back(std::make_shared<RestMotion>(pose));
      shape = are_meshes ? std::shared_ptr<const Shape>(mesh) : box;
      set.add({shape, motions.back(), 1, false});
    }
    for (std::size_t i = 0; i < kQueries; ++i) {
      paths.emplace_back(random_pose(half, random), Twist{0.5 * half * random_direction(random),
                                                          2 * random_direction(random)});
    }
  }

  ObstacleSet set;
  std::shared_ptr<const Shape> shape;
  std::vector<std::shared_ptr<const RestMotion>> motions;
  std::vector<ConstantTwistMotion> paths;
  TriangleMesh body = testing::gear(24, 0.2, 0.25, 0.1).mesh();
};

void first_impact_of_set(benchmark::State& state) {
  const ManyObstacles scene(state.range(0), state.range(1) != 0);
  ObstacleWorkspace workspace;
  std::size_t i = 0;
  Scalar hits = 0;
  Scalar work = 0;
  for (auto _ : state) {
    const ObstacleImpact found =
        scene.set.first_impact(scene.body, scene.paths[i++ % kQueries], kSpan, {}, {}, workspace);
    hits += found.obstacle.has_value() ? 1 : 0;
    work += Scalar(found.toi.statistics.node_pairs);
  }
  state.counters["hits"] = hits / Scalar(i);
  state.counters["work"] = work / Scalar(i);
}

void first_impact_of_loop(benchmark::State& state) {
  const ManyObstacles scene(state.range(0), state.range(1) != 0);
  ToiWorkspace workspace;
  std::size_t i = 0;
  Scalar hits = 0;
  Scalar work = 0;
  for (auto _ : state) {
    Scalar first = kInfinity;
    // What a careful user writes: no later than the first impact so far.
    for (const auto& motion : scene.motions) {
      const ToiResult found =
          time_of_impact(scene.body, scene.paths[i % kQueries], *scene.shape, *motion,
                         {0, std::min(first, kSpan.end)}, {}, workspace);
      if (found.status != ToiStatus::Separated) first = std::min(first, found.t_safe);
      work += Scalar(found.statistics.node_pairs);
    }
    hits += first <= kSpan.end ? 1 : 0;
    ++i;
  }
  state.counters["hits"] = hits / Scalar(i);
  state.counters["work"] = work / Scalar(i);
}

void nearest_of_set(benchmark::State& state) {
  const ManyObstacles scene(state.range(0), state.range(1) != 0);
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(scene.set.nearest(scene.body, scene.paths[i++ % kQueries].pose(0)));
  }
}

void nearest_of_loop(benchmark::State& state) {
  const ManyObstacles scene(state.range(0), state.range(1) != 0);
  std::size_t i = 0;
  for (auto _ : state) {
    DistanceOptions options;
    for (const auto& motion : scene.motions) {
      const DistanceResult found = distance(scene.body, scene.paths[i % kQueries].pose(0),
                                            *scene.shape, motion->pose(0), options);
      options.max_distance = std::min(options.max_distance, found.upper);
    }
    benchmark::DoNotOptimize(options);
    ++i;
  }
}

void least_distance_of_set(benchmark::State& state) {
  const ManyObstacles scene(state.range(0), state.range(1) != 0);
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        scene.set.least_distance(scene.body, scene.paths[i++ % kQueries], kSpan));
  }
}

void least_distance_of_loop(benchmark::State& state) {
  const ManyObstacles scene(state.range(0), state.range(1) != 0);
  std::size_t i = 0;
  for (auto _ : state) {
    LeastDistanceOptions options;
    for (const auto& motion : scene.motions) {
      const LeastDistanceResult found = least_distance(scene.body, scene.paths[i % kQueries],
                                                       *scene.shape, *motion, kSpan, options);
      options.max_distance = std::min(options.max_distance, found.upper);
    }
    benchmark::DoNotOptimize(options);
    ++i;
  }
}

// Two tori of 9,216 triangles that pass by each other, with the relative tolerance 10^-digits.
void least_distance_of_pair(benchmark::State& state) {
  std::mt19937_64 random(11);
  const TriangleMesh mesh = testing::torus(0.7, 0.3, 96, 48).mesh();
  LeastDistanceOptions options;
  options.relative_tolerance = std::pow(10, -Scalar(state.range(0)));
  std::vector<std::pair<ConstantTwistMotion, ConstantTwistMotion>> passes;
  while (passes.size() < kQueries) {
    const auto path = [&](Scalar side) {
      const Vector3 start = 2 * random_direction(random) + Vector3(side, 0, 0);
      return ConstantTwistMotion(RigidPose(random_rotation(random), start),
                                 Twist{2 * random_direction(random), 3 * random_direction(random)});
    };
    passes.emplace_back(path(-2), path(2));
    const auto& [X_WA, X_WB] = passes.back();
    if (!(least_distance(mesh, X_WA, mesh, X_WB, kSpan).lower > 0)) passes.pop_back();
  }
  std::size_t i = 0;
  Scalar queries = 0;
  Scalar work = 0;
  for (auto _ : state) {
    const auto& [X_WA, X_WB] = passes[i++ % kQueries];
    const LeastDistanceResult found = least_distance(mesh, X_WA, mesh, X_WB, kSpan, options);
    queries += Scalar(found.distance_queries);
    work += Scalar(found.statistics.node_pairs);
  }
  state.counters["queries"] = queries / Scalar(i);
  state.counters["work"] = work / Scalar(i);
}

void sizes(benchmark::internal::Benchmark* bench) {
  bench->ArgNames({"obstacles", "meshes"});
  for (const int meshes : {0, 1}) {
    for (const int count : {45, 1000}) bench->Args({count, meshes});
  }
  bench->Unit(benchmark::kMicrosecond);
}

BENCHMARK(first_impact_of_set)->Apply(sizes);
BENCHMARK(first_impact_of_loop)->Apply(sizes);
BENCHMARK(nearest_of_set)->Apply(sizes);
BENCHMARK(nearest_of_loop)->Apply(sizes);
BENCHMARK(least_distance_of_set)->Apply(sizes);
BENCHMARK(least_distance_of_loop)->Apply(sizes);
BENCHMARK(least_distance_of_pair)->ArgName("digits")->DenseRange(1, 9, 2)->Iterations(kQueries);

}  // namespace
}  // namespace dyop::testing
