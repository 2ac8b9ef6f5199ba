// SPDX-License-Identifier: BSD-3-Clause

// A batch of time of impact queries of two Stanford bunnies over one, two and all threads. `query`
// is the time of one query; the ratio of the first two lines is what the second thread gives.

#include <benchmark/benchmark.h>

#include <random>
#include <vector>

#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/models.h"
#include "support/inputs/random_inputs.h"

namespace dyop::testing {
namespace {

constexpr int kQueryCount = 400;

// The queries hold pointers into it: not to be moved.
struct Batch {
  explicit Batch(const std::filesystem::path& file);
  Batch(const Batch&) = delete;
  Batch& operator=(const Batch&) = delete;

  TriangleMesh mesh;
  std::vector<ConstantTwistMotion> motions;
  std::vector<ToiQuery> queries;
};

// Bodies of radius one that start 2 to 5 apart, fly at each other slightly off centre, and turn.
Batch::Batch(const std::filesystem::path& file) : mesh(load_unit_model(file)) {
  std::mt19937_64 random(42);
  for (int k = 0; k < kQueryCount; ++k) {
    const Scalar distance = random_number(2, 5, random);
    const Vector3 p = distance * random_direction(random);
    const Vector3 v = random_vector(1, random) - p;
    const Vector3 w_A = random_vector(3, random);
    const Vector3 w_B = random_vector(3, random);
    motions.emplace_back(RigidPose(random_rotation(random), Vector3::Zero()),
                         Twist{Vector3::Zero(), w_A});
    motions.emplace_back(RigidPose(random_rotation(random), p), Twist{v, w_B});
  }
  for (std::size_t k = 0; k < kQueryCount; ++k) {
    queries.push_back({&mesh, &motions[2 * k], &mesh, &motions[2 * k + 1], {0, 1}, {}});
  }
}

void run(benchmark::State& state) {
  const auto file = find_model("bunny.obj");
  if (!file) {
    state.SkipWithError("no bunny.obj: install glmark2-data or set DYOP_MESH_PATH");
    return;
  }
  Batch batch(*file);
  BatchOptions options;
  options.thread_count = static_cast<int>(state.range(0));
  std::vector<ToiResult> results(batch.queries.size());
  for (auto _ : state) time_of_impact_batch(batch.queries, results, options);
  int impacts = 0;
  for (const ToiResult& result : results) impacts += result.status == ToiStatus::Impact;
  state.counters["impacts"] = impacts;
  using benchmark::Counter;
  state.counters["query"] =
      Counter(kQueryCount, Counter::kIsIterationInvariantRate | Counter::kInvert);
}

BENCHMARK(run)
    ->Name("bunnies/threads")
    ->Arg(1)
    ->Arg(2)
    ->Arg(0)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dyop::testing
