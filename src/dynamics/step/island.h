// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "dynamics/joint_state.h"
#include "dynamics/spring_state.h"
#include "dynamics/step/ledger.h"
#include "dynamics/step/track.h"
#include "dyop/core/types.h"
#include "dyop/dynamics/advance_report.h"

namespace dyop::dynamics_internal {

/// Adds the time it lives, in seconds, to a sum, unless it is off: then it reads no clock.
class PartTimer {
 public:
  PartTimer(bool is_on, Scalar& sum) : sum_(is_on ? &sum : nullptr) {
    if (sum_) begin_ = Clock::now();
  }
  ~PartTimer() {
    if (sum_) *sum_ += std::chrono::duration<Scalar>(Clock::now() - begin_).count();
  }
  PartTimer(const PartTimer&) = delete;
  PartTimer& operator=(const PartTimer&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  Scalar* sum_;
  Clock::time_point begin_;
};

/// Awake dynamic bodies that are stepped together, and the pairs to be proven with them: between
/// two of them, or of one of them with a body that cannot be moved.
struct Island {
  std::vector<std::uint32_t> bodies;  // slots, sorted
  std::vector<PairState*> pairs;      // by key
  std::vector<JointState*> joints;    // with at least one body in `bodies`
  std::vector<SpringState*> springs;  // the same

  void clear();  // keeps its memory
};

/// Why an island could not continue.
struct IslandFailure {
  AdvanceStatus status = AdvanceStatus::NotRun;
  PairKey pair;
};

/// A proposed step of an island.
struct IslandOutcome {
  bool has_run = false;
  Scalar reached = 0;         // the step's end, unless an impact comes first or it failed
  std::vector<Track> tracks;  // by Island::bodies
  std::vector<PairProof> proofs;
  std::vector<ImpactEvent> impacts;
  std::optional<IslandFailure> failure;
  bool stopped_at_impact = false;  // the last of `impacts`
  bool in_contact = false;         // at its end
  StepStatistics work;
  StepTimes times;
  ToiStatistics toi;
  IntegratorStatistics integrator;

  /// As new, but for the memory of the tracks.
  void restart();
};

/// Runs by the bodies of their islands.
/// Adds the work that counts whether a run is kept or not.
void add_cost(AdvanceReport& report, const IslandOutcome& outcome);

using IslandRuns = std::map<std::vector<std::uint32_t>, IslandOutcome>;

/// What a step plans and finds, by island and by slot. From step to step only memory is kept.
struct StepMemory {
  std::vector<Island> islands;
  std::vector<IslandOutcome> outcomes;
  std::vector<BodyMove> moves;
  std::vector<AlignedBox> boxes;

  /// Takes out the runs of islands without a dirty body; the work of the others is added to the
  /// report as discarded.
  IslandRuns take_runs(const std::vector<bool>& is_dirty, AdvanceReport& report);
  /// One outcome for each of `count` islands, run if its bodies are those of a kept run.
  void place_runs(std::size_t count, IslandRuns kept);
};

}  // namespace dyop::dynamics_internal
