// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <set>
#include <utility>
#include <vector>

#include "dynamics/world_impl.h"

namespace dyop::dynamics_internal {

/// One step of a World, in stages; run() is their list.
///
///      predict            a box for every body that holds it over the step, by its velocity
///         |
///       pair              bodies whose boxes meet; what is reached wakes
///         |
///    make islands  <----------------------------------+   bodies joined by contacts, links, hits
///         |                                           |
///   substep islands       each on some thread:        |
///         |                 +-> solve  impulses       |
///         |                 |     |                   |
///         |                 |   move   to the end     |
///         |                 |     |                   |
///         |                 +-- prove  or add hits,   |
///         |                            or shorten     |
///         |                                           |
///   prove the rest  --- pairs of islands that met ----+
///         |
///       commit            a full ledger, or nothing
///         |
///       sleep             what is balanced, or slow for long
///
/// To read on: world_step.cpp has the stages; island.h one island, in free flight or by substeps;
/// substep.cpp solve, move and prove; substep_problem.h what is solved; end_gap.h where contacts
/// end; link_rows.h joints and springs; impact.cpp the impact law; ledger.h one proof, and
/// all of them; track.h how bodies move; world_impl.cpp commits, sleeping.cpp puts to sleep.
class WorldStep {
 public:
  WorldStep(World::Impl& world, Scalar t_end, const AdvanceLimits& limits, AdvanceReport& report);
  ~WorldStep();

  /// Returns the status if the advance ends here, NotRun if it continues.
  AdvanceStatus run();

 private:
  /// Proofs of the pairs that no island proves.
  struct RestProofs {
    std::vector<PairProof> proofs;
    std::vector<PairKey> met;  // not proven: their islands belong together
  };

  // The stages.
  void predict();
  void pair();
  void make_islands();
  void substep_islands();
  RestProofs prove_the_rest();
  AdvanceStatus commit(std::vector<PairProof> proofs);
  AdvanceStatus commit_rest();

  // Predict and pair.
  AlignedBox predicted_box(const BodyRecord& body);
  AlignedBox box_around(const BodyRecord& body, const RigidPose& X_WB, Scalar travel) const;
  AlignedBox box_around(const HalfSpace& half_space, const RigidPose& X_WB, Scalar travel) const;
  Scalar reach_of(Scalar size) const;
  AlignedBox box_of(const BodyRecord& body, const BodyMove& move) const;
  AlignedBox box_of(const BodyRecord& body, const BodyMove& move, const TwistBound& bound) const;
  void merge_pairs(const std::vector<std::pair<std::int32_t, std::int32_t>>& found);
  void find_touching();

  // Islands.
  std::size_t number_islands(const std::function<std::uint32_t(std::uint32_t)>& root_of);
  void assign_pairs();
  void assign_links();
  bool foresee_hits();
  void join_islands(const std::vector<PairKey>& met);
  void run_islands();
  void shorten_to_reached();

  // Proofs.
  const BodyMove& move_of(std::uint32_t slot);
  BodyMove found_move(std::uint32_t slot) const;
  void forget_moves();
  void pair_what_left_its_box();
  bool is_examined(PairKey key) const;
  std::vector<PairState*> open_pairs(RestProofs& rest);
  void bound_speeds(const std::vector<PairState*>& open);
  void prove_pair(PairState& pair, Certificate& certificate, ToiWorkspace& workspace) const;
  std::vector<PairKey> candidates() const;

  // The end.
  void give_up();
  AdvanceStatus status_or(AdvanceStatus otherwise);
  void report_crossings();
  void add_totals();

  World::Impl& world_;
  AdvanceReport& report_;
  StepContext context_;
  bool is_planned_ = false;              // what the memory holds is of this step
  std::vector<AlignedBox>& boxes_;       // by slot
  std::vector<Scalar> own_targets_;      // by slot: the largest target given for a pair
  std::vector<Scalar> expected_travel_;  // by slot: how far boxes_ let a body go; -1: not known
  std::vector<bool> may_move_;           // by slot
  bool has_moving_ = false;              // one of them
  std::vector<PairKey> touching_;        // pairs in contact at the start
  std::set<PairKey> met_;                // from hits in this step
  std::vector<std::int32_t> island_of_;  // by slot; -1: none
  std::vector<bool> is_dirty_;           // by slot: its island must run again
  std::vector<Island>& islands_;
  std::vector<IslandOutcome>& outcomes_;
  std::vector<BodyMove>& moves_;             // by slot, over the whole step, once asked for
  std::vector<std::uint32_t>& known_moves_;  // the slots of those asked for
};

}  // namespace dyop::dynamics_internal
