// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/island/island.h"

#include <algorithm>
#include <utility>

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

IslandRuns StepMemory::take_runs(const std::vector<bool>& is_dirty) {
  IslandRuns kept;
  for (std::size_t i = 0; i < outcomes.size(); ++i) {
    const std::vector<std::uint32_t>& bodies = islands[i].bodies;
    const bool must_rerun = std::any_of(bodies.begin(), bodies.end(),
                                        [&](std::uint32_t slot) { return is_dirty[slot]; });
    if (outcomes[i].has_run && !must_rerun) kept.emplace(bodies, std::move(outcomes[i]));
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
