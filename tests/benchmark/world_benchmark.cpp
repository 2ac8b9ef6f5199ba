// SPDX-License-Identifier: BSD-3-Clause

// Time per step of the World, one thread: free flight, stacks, columns, a pyramid, bricks, piles;
// some of them in Bullet too.
#include <benchmark/benchmark.h>

#include "bullet_copy.h"
#include "dyop/dynamics/world.h"
#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

WorldOptions awake_options() {
  WorldOptions options = earth_options();
  options.thread_count = 1;
  options.sleep_steps = 0;
  options.records_motions = false;
  return options;
}

// Steps one world; prints what it did beside its time.
void step(benchmark::State& state, World& world, Scalar h) {
  StepStatistics work;
  std::int64_t steps = 0;
  for (auto _ : state) {
    const AdvanceReport report = world.advance(h);
    if (report.status != AdvanceStatus::Completed) {
      state.SkipWithError("not completed");
      break;
    }
    ++steps;
    work.stalls += report.work.stalls;
    work.unconverged += report.work.unconverged;
    work.contacts = std::max(work.contacts, report.work.contacts);
  }
  state.counters["contacts"] = static_cast<double>(work.contacts);
  state.counters["stalls"] = static_cast<double>(work.stalls);
  state.counters["unconverged"] = static_cast<double>(work.unconverged);
  state.counters["steps"] = static_cast<double>(steps);
}

void BM_FreeFlight(benchmark::State& state) {
  WorldOptions options = awake_options();
  options.gravity_W.setZero();
  World world(options);
  add_free_bodies(world, static_cast<int>(state.range(0)));
  step(state, world, 0.01);
}
BENCHMARK(BM_FreeFlight)->Arg(100)->Arg(1000)->Arg(8000)->Arg(64000)->Unit(benchmark::kMillisecond);

void BM_Stack(benchmark::State& state) {
  World world(awake_options());
  add_columns(world, 1, static_cast<int>(state.range(0)));
  step(state, world, 0.01);
}
BENCHMARK(BM_Stack)->Arg(5)->Arg(10)->Unit(benchmark::kMillisecond);

void BM_Columns(benchmark::State& state) {
  World world(awake_options());
  add_columns(world, static_cast<int>(state.range(0)), 10);
  step(state, world, 1.0 / 60);
}
BENCHMARK(BM_Columns)->Arg(100)->Unit(benchmark::kMillisecond);

void BM_Pyramid(benchmark::State& state) {
  World world(awake_options());
  add_pyramid(world, static_cast<int>(state.range(0)));
  step(state, world, 1.0 / 60);
}
BENCHMARK(BM_Pyramid)->Arg(20)->Unit(benchmark::kMillisecond);

void BM_Bricks(benchmark::State& state) {
  World world(awake_options());
  add_bricks(world, static_cast<int>(state.range(0)), 36);
  step(state, world, 1.0 / 60);
}
BENCHMARK(BM_Bricks)->Arg(28)->Unit(benchmark::kMillisecond);

void step_in_bullet(benchmark::State& state, const World& world) {
  testing::BulletCopy copy(world, awake_options().gravity_W);
  for (auto _ : state) copy.step(1.0 / 60);
}

void BM_BulletColumns(benchmark::State& state) {
  World world(awake_options());
  add_columns(world, static_cast<int>(state.range(0)), 10);
  step_in_bullet(state, world);
}
BENCHMARK(BM_BulletColumns)->Arg(100)->Unit(benchmark::kMillisecond);

void BM_BulletPyramid(benchmark::State& state) {
  World world(awake_options());
  add_pyramid(world, static_cast<int>(state.range(0)));
  step_in_bullet(state, world);
}
BENCHMARK(BM_BulletPyramid)->Arg(20)->Unit(benchmark::kMillisecond);

void BM_BulletBricks(benchmark::State& state) {
  World world(awake_options());
  add_bricks(world, static_cast<int>(state.range(0)), 36);
  step_in_bullet(state, world);
}
BENCHMARK(BM_BulletBricks)->Arg(28)->Unit(benchmark::kMillisecond);

void BM_Pile(benchmark::State& state) {
  World world(awake_options());
  add_pile(world, static_cast<int>(state.range(0)));
  step(state, world, 0.01);
}
BENCHMARK(BM_Pile)->Arg(3)->Arg(5)->Iterations(150)->Unit(benchmark::kMillisecond);

// The growth of a step with the number of bodies, and with 1 and 2 threads: compare elapsed times.
void BM_FallingPile(benchmark::State& state) {
  WorldOptions options = awake_options();
  options.thread_count = static_cast<int>(state.range(1));
  World world(options);
  add_pile(world, static_cast<int>(state.range(0)));
  step(state, world, 0.01);
}
BENCHMARK(BM_FallingPile)
    ->ArgNames({"side", "threads"})
    ->ArgsProduct({{5, 10, 20}, {1, 2}})
    ->Iterations(150)
    ->UseRealTime()
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

void BM_Asleep(benchmark::State& state) {
  WorldOptions options = awake_options();
  options.sleep_steps = 5;
  World world(options);
  add_columns(world, static_cast<int>(state.range(0)), 10);
  for (int k = 0; k < 60; ++k) world.advance(0.01);
  step(state, world, 0.01);
}
BENCHMARK(BM_Asleep)->Arg(100)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace dyop
