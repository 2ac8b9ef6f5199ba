// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <set>
#include <vector>

#include "dynamics/world_impl.h"

namespace dyop::dynamics_internal {

/// One step of a World: plans islands, runs them, proves the pairs between them, merges and reruns
/// islands that met, commits.
class WorldStep {
 public:
  WorldStep(World::Impl& world, Scalar t_end, const AdvanceLimits& limits, AdvanceReport& report);
  ~WorldStep();

  /// Returns the status if the advance ends here, NotRun if it continues.
  AdvanceStatus run();

 private:
  void find_candidates();
  AlignedBox predicted_box(const BodyRecord& body);
  AlignedBox box_around(const BodyRecord& body, const RigidPose& X_WB, Scalar way) const;
  AlignedBox box_of(const BodyRecord& body, const BodyMove& move) const;
  AlignedBox box_of(const BodyRecord& body, const BodyMove& move, const TwistBound& bound) const;
  void merge_pairs(const std::vector<std::pair<std::int32_t, std::int32_t>>& found);
  void link_pairs();
  void plan_islands();
  bool forecast_links();
  void run_islands();
  void shorten_to_reached();
  void commit_rest();
  bool prove_the_rest();
  bool find_new_candidates();
  void prove_pair(PairState& pair, Certificate& certificate, ToiWorkspace& workspace) const;
  BodyMove move_of(std::uint32_t slot) const;
  void report_crossings();
  void add_totals();
  std::vector<PairKey> candidates() const;
  template <typename Item>
  void run_parallel(std::size_t item_count, const Item& item);

  World::Impl& world_;
  AdvanceReport& report_;
  StepContext context_;
  bool is_planned_ = false;              // what the memory holds is of this step
  std::vector<AlignedBox>& boxes_;       // by slot
  std::vector<Scalar> own_targets_;      // by slot: the largest target given for a pair
  std::vector<Scalar> expected_way_;     // by slot: how far boxes_ let a body go; -1: not known
  std::vector<bool> may_move_;           // by slot
  bool has_moving_ = false;              // one of them
  std::vector<PairKey> touching_;        // pairs in contact at the start
  std::set<PairKey> forced_links_;       // from hits in this step
  std::vector<std::int32_t> island_of_;  // by slot; -1: none
  std::vector<bool> is_dirty_;           // by slot: its island must run again
  std::vector<Island>& islands_;
  std::vector<IslandOutcome>& outcomes_;
  std::vector<BodyMove>& moves_;   // by slot, over the whole step
  std::vector<PairProof> proofs_;  // of pairs between islands
};

}  // namespace dyop::dynamics_internal
