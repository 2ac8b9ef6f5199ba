// SPDX-License-Identifier: BSD-3-Clause

// What the dynamic pivot saves: the same walk of two shapes, measured step by step, with queries
// that start anywhere (seed 0), at what the pivot of the internal box picks (1), and where the last
// query ended (2). Counters: work per query.
#include <benchmark/benchmark.h>

#include <memory>
#include <random>

#include "distance/pivot_seed.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "toi/toi_memory.h"

namespace dyop {
namespace {

using distance_internal::PairSeed;

enum Kind { kBoxes, kHulls, kTori };

std::shared_ptr<const Shape> make_shape(int kind) {
  if (kind == kBoxes) return std::make_shared<Box>(Vector3(0.8, 0.5, 0.3));
  if (kind == kTori) {
    return std::make_shared<TriangleMesh>(testing::torus(0.7, 0.3, 128, 64).mesh());
  }
  std::mt19937_64 random(5);
  std::vector<Vector3> points(64);
  for (Vector3& p : points) p = testing::random_direction(random);
  return std::make_shared<ConvexHull>(points);
}

// B beside A at the gap, and how it drifts from step to step.
struct Walk {
  explicit Walk(const Shape& shape, Scalar gap) {
    std::mt19937_64 random(7);
    constexpr int kWalks = 20;
    constexpr int kSteps = 25;
    for (int k = 0; k < kWalks; ++k) {
      const Vector3 direction = testing::random_direction(random);
      const Matrix3 R = testing::random_rotation(random).toRotationMatrix();
      const ConstantTwistMotion approach(RigidPose(R, 4 * direction),
                                         {-direction, Vector3::Zero()});
      ToiOptions options;
      options.target_distance = gap;
      options.distance_tolerance = gap / 100;
      const ToiResult met =
          time_of_impact(shape, RestMotion(RigidPose()), shape, approach, {0, 4}, options);
      if (met.status != ToiStatus::Impact) continue;
      RigidPose X_WB = met.X_WB;
      starts.push_back(poses.size());
      for (int i = 0; i < kSteps; ++i) {
        poses.push_back(X_WB);
        const Vector3 slide = direction.cross(testing::random_direction(random));
        X_WB =
            RigidPose(rotation_from_vector(testing::random_vector(0.01, random)) * X_WB.rotation(),
                      X_WB.translation() + 0.005 * slide);
      }
    }
  }
  std::vector<RigidPose> poses;
  std::vector<std::size_t> starts;
};

void measure_distance(benchmark::State& state) {
  const auto shape = make_shape(int(state.range(0)));
  const Scalar gap = Scalar(state.range(1)) / 1000;
  const Walk walk(*shape, gap);
  DistanceStatistics work;
  Scalar queries = 0;
  for (auto _ : state) {
    PairSeed seed;
    std::size_t start = 0;
    for (std::size_t i = 0; i < walk.poses.size(); ++i) {
      const bool is_first = start < walk.starts.size() && walk.starts[start] == i;
      if (is_first) ++start;
      const RigidPose& X_WB = walk.poses[i];
      if (state.range(2) == 0 || is_first) seed = {};
      if (state.range(2) == 1 || (state.range(2) == 2 && is_first)) {
        const distance_internal::Pivot pivot =
            distance_internal::internal_box_pivot(*shape, RigidPose(), *shape, X_WB);
        seed = distance_internal::seed_at(pivot, *shape, RigidPose(), *shape, X_WB);
      }
      const DistanceResult result =
          distance_internal::seeded_distance(*shape, RigidPose(), *shape, X_WB, {}, seed);
      benchmark::DoNotOptimize(result.lower);
      work.box_tests += result.statistics.box_tests;
      work.leaf_tests += result.statistics.leaf_tests;
      work.gjk_iterations += result.statistics.gjk_iterations;
      ++queries;
    }
  }
  state.SetItemsProcessed(std::int64_t(queries));
  state.counters["boxes"] = Scalar(work.box_tests) / queries;
  state.counters["leaves"] = Scalar(work.leaf_tests) / queries;
  state.counters["gjk"] = Scalar(work.gjk_iterations) / queries;
}
BENCHMARK(measure_distance)
    ->ArgNames({"kind", "gap", "seed"})
    ->ArgsProduct({{kBoxes, kHulls, kTori}, {1, 100}, {0, 1, 2}})
    ->Unit(benchmark::kMicrosecond);

// The impact query of each step, from the supports that the distance left.
void measure_impact(benchmark::State& state) {
  const auto shape = make_shape(int(state.range(0)));
  const Walk walk(*shape, Scalar(state.range(1)) / 1000);
  ToiOptions options;
  options.target_distance = 1e-4;     // literal: the World's default
  options.distance_tolerance = 1e-4;  // literal: of the size of the World's
  ToiWorkspace workspace;
  Scalar queries = 0;
  Scalar node_pairs = 0;
  for (auto _ : state) {
    PairSeed seed;
    for (const RigidPose& X_WB : walk.poses) {
      const ConstantTwistMotion motion(X_WB, {-0.3 * X_WB.translation(), Vector3(0.3, 0.2, 0.1)});
      if (state.range(2) > 0) workspace.memory().start = seed.supports;
      const ToiResult result = time_of_impact(*shape, RestMotion(RigidPose()), *shape, motion,
                                              {0, 0.01}, options, workspace);
      seed.supports = workspace.memory().seed;
      node_pairs += Scalar(result.statistics.node_pairs);
      ++queries;
    }
  }
  state.SetItemsProcessed(std::int64_t(queries));
  state.counters["steps"] = node_pairs / queries;
}
BENCHMARK(measure_impact)
    ->ArgNames({"kind", "gap", "seed"})
    ->ArgsProduct({{kBoxes, kHulls}, {1, 100}, {0, 2}})
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace dyop
