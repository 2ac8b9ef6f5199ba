// SPDX-License-Identifier: BSD-3-Clause

// One step of the contact solvers, from nothing and from the impulses of the step before, on scenes
// that rest, at a residual of 1e-6 for speeds of 0.1. `residual` below it says that the solver
// converged; `iterations` are sweeps, factorisations or ADMM iterations, all together.

#include <benchmark/benchmark.h>

#include "dyop/contact/contact_solver.h"
#include "support/inputs/contact_scenes.h"

namespace dyop::testing {
namespace {

enum class Start { Cold, Warm };

// A warm step begins with the solution of the last one and takes up gravity and a little noise.
ContactProblem next_step(ContactProblem problem) {
  Scalar sign = 1;
  for (ContactBody& body : problem.bodies) {
    if (body.inverse_mass_W.isZero(0)) continue;
    body.free_v_W += sign * 0.002 * Vector3(1, 0.5, 0.3);
    body.free_w_W += sign * 0.002 * Vector3(0.3, 1, 0.5);
    sign = -sign;
  }
  return problem;
}

template <typename Solver>
void solve(benchmark::State& state, const ContactProblem& scene, Start start) {
  ContactSolverOptions options;
  options.tolerance = 1e-6;  // literal: see above
  ContactProblem first = scene;
  ContactCascade cascade;
  cascade.solve(first, options);
  const ContactProblem begin = start == Start::Cold ? scene : next_step(first);
  if (!std::is_same_v<Solver, ContactCascade>) {  // by themselves they may take longer
    options.sweep_limit = options.few_sweep_limit = 2000;
    options.newton_limit = 500;
    options.admm_limit = 2000;
  }
  Solver solver;
  ContactProblem problem;
  ContactReport report;
  for (auto _ : state) {
    problem = begin;
    report = solver.solve(problem, options);
  }
  state.counters["contacts"] = double(scene.contacts.size());
  state.counters["iterations"] = report.sweeps + report.newton_iterations + report.admm_iterations;
  state.counters["residual"] = report.residual;
}

template <typename Solver>
void add(const std::string& solver, const std::string& name, const ContactProblem& scene) {
  for (const Start start : {Start::Cold, Start::Warm}) {
    const std::string label = name + "/" + solver + (start == Start::Cold ? "/cold" : "/warm");
    benchmark::RegisterBenchmark(label.c_str(), [scene, start](benchmark::State& state) {
      solve<Solver>(state, scene, start);
    })->Unit(benchmark::kMicrosecond);
  }
}

void add_scene(const std::string& name, const ContactProblem& scene) {
  add<GaussSeidelSolver>("gauss_seidel", name, scene);
  add<NewtonSolver>("newton", name, scene);
  add<AdmmSolver>("admm", name, scene);
  add<ContactCascade>("cascade", name, scene);
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  using namespace dyop::testing;
  add_scene("tool_4", haptic_scene(4));
  add_scene("tool_12", haptic_scene(12));
  add_scene("stack_10", stack_scene(10));
  add_scene("arch_25", arch_scene(25));
  add_scene("arch_101", arch_scene(101));
  add_scene("pile_125", pile_scene(5, 5));
  add_scene("wall_450", wall_scene(30, 15));
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
