// SPDX-License-Identifier: BSD-3-Clause

// Times of impact of deforming meshes: a wobbling sphere of 81,920 triangles that meets another
// one, or a spinning rigid gear. Each iteration is another query; nothing is warm but the code.

#include <benchmark/benchmark.h>

#include <cmath>
#include <random>
#include <vector>

#include "dyop/motion/steady_motions.h"
#include "dyop/toi/deforming_time_of_impact.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace {

using dyop::DeformingMesh;
using dyop::TimeInterval;
using dyop::ToiResult;
using dyop::Vector3;
using dyop::testing::MeshArrays;

constexpr int kQueries = 32;
constexpr int kSubdivisions = 6;

std::vector<Vector3> wobbled(const std::vector<Vector3>& places, const Vector3& way) {
  std::vector<Vector3> moved = places;
  for (Vector3& p : moved) {
    p += way + 0.1 * Vector3(std::sin(5 * p.y()), std::sin(4 * p.z()), std::sin(6 * p.x()));
  }
  return moved;
}

// The second body comes from 2.5 away and aims beside the middle of the first.
struct Approach {
  Vector3 from;
  Vector3 way;
};

std::vector<Approach> make_approaches() {
  std::mt19937_64 random(1);
  std::vector<Approach> approaches;
  for (int i = 0; i < kQueries; ++i) {
    const Vector3 from = 2.5 * dyop::testing::random_direction(random);
    approaches.push_back({from, dyop::testing::random_vector(1.2, random) - from});
  }
  return approaches;
}

void count(const ToiResult& result, benchmark::State& state) {
  state.counters["impacts"] += result.status == dyop::ToiStatus::Impact ? 1 : 0;
  state.counters["node_pairs"] += static_cast<double>(result.statistics.node_pairs);
  state.counters["leaf_tests"] += static_cast<double>(result.statistics.leaf_tests);
}

void average(benchmark::State& state) {
  for (auto& [name, counter] : state.counters) counter.flags = benchmark::Counter::kAvgIterations;
}

void deforming_against_deforming(benchmark::State& state) {
  const MeshArrays sphere = dyop::testing::icosphere(kSubdivisions);
  const DeformingMesh a(sphere.vertices, wobbled(sphere.vertices, Vector3::Zero()),
                        sphere.triangles);
  std::vector<DeformingMesh> others;
  for (const Approach& approach : make_approaches()) {
    const MeshArrays begin = sphere.moved(dyop::Matrix3::Identity(), approach.from);
    others.emplace_back(begin.vertices, wobbled(begin.vertices, approach.way), begin.triangles);
  }
  std::size_t next = 0;
  for (auto _ : state) {
    const ToiResult result =
        dyop::time_of_impact(a, others[next++ % others.size()], TimeInterval{0, 1});
    count(result, state);
  }
  average(state);
}

void deforming_against_spinning(benchmark::State& state) {
  const MeshArrays sphere = dyop::testing::icosphere(kSubdivisions);
  const DeformingMesh a(sphere.vertices, wobbled(sphere.vertices, Vector3::Zero()),
                        sphere.triangles);
  const dyop::TriangleMesh gear = dyop::testing::gear(200, 0.9, 1.0, 0.3).mesh();
  const std::vector<Approach> approaches = make_approaches();
  std::size_t next = 0;
  for (auto _ : state) {
    const Approach& approach = approaches[next++ % approaches.size()];
    const dyop::ConstantTwistMotion X_WB(dyop::RigidPose(approach.from),
                                         {approach.way, Vector3(1, 4, 2)});
    count(dyop::time_of_impact(a, gear, X_WB, TimeInterval{0, 1}), state);
  }
  average(state);
}

void refit(benchmark::State& state) {
  const MeshArrays sphere = dyop::testing::icosphere(kSubdivisions);
  DeformingMesh mesh(sphere.vertices, sphere.vertices, sphere.triangles);
  const std::vector<Vector3> end = wobbled(sphere.vertices, Vector3::Zero());
  for (auto _ : state) mesh.refit(sphere.vertices, end);
}

BENCHMARK(deforming_against_deforming)->Unit(benchmark::kMillisecond);
BENCHMARK(deforming_against_spinning)->Unit(benchmark::kMillisecond);
BENCHMARK(refit)->Unit(benchmark::kMillisecond);

}  // namespace
