// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/island.h"

#include <algorithm>
#include <utility>

#include "dynamics/step/certify.h"

namespace dyop::dynamics_internal {

void Island::clear() {
  bodies.clear();
  pairs.clear();
  joints.clear();
  springs.clear();
}

void IslandOutcome::restart() {
  std::vector<Track> memory = std::move(tracks);
  *this = {};
  tracks = std::move(memory);
}

void add_cost(AdvanceReport& report, const IslandOutcome& outcome) {
  report.work.unconverged += outcome.work.unconverged;
  report.times.flight += outcome.times.flight;
  report.times.contacts += outcome.times.contacts;
  report.times.solve += outcome.times.solve;
  report.times.ends += outcome.times.ends;
  report.times.proofs += outcome.times.proofs;
  add(report.toi, outcome.toi);
  report.integrator.steps += outcome.integrator.steps;
  report.integrator.rejected_steps += outcome.integrator.rejected_steps;
  report.integrator.function_evaluations += outcome.integrator.function_evaluations;
}

IslandRuns StepMemory::take_runs(const std::vector<bool>& is_dirty, AdvanceReport& report) {
  IslandRuns kept;
  for (std::size_t i = 0; i < outcomes.size(); ++i) {
    const std::vector<std::uint32_t>& bodies = islands[i].bodies;
    const bool must_rerun = std::any_of(bodies.begin(), bodies.end(),
                                        [&](std::uint32_t slot) { return is_dirty[slot]; });
    if (!outcomes[i].has_run) continue;
    if (must_rerun) {
      ++report.work.discarded_runs;
      add_cost(report, outcomes[i]);
    } else {
      kept.emplace(bodies, std::move(outcomes[i]));
    }
  }
  return kept;
}

void StepMemory::place_runs(std::size_t count, IslandRuns kept) {
  islands.resize(count);
  outcomes.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    outcomes[i].has_run = false;
    const auto known = kept.empty() ? kept.end() : kept.find(islands[i].bodies);
    if (known != kept.end()) outcomes[i] = std::move(known->second);
  }
}

}  // namespace dyop::dynamics_internal
