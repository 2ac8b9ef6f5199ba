// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include "dynamics/body_record.h"
#include "dynamics/broad_phase.h"
#include "dynamics/link_state.h"
#include "dynamics/pair_state.h"
#include "dynamics/step/island.h"
#include "dynamics/step/ledger.h"
#include "dyop/dynamics/world.h"
#include "dyop/dynamics/world_query.h"
#include "dyop/toi/obstacle_set.h"

namespace dyop::dynamics_internal {

/// The bodies of a World as obstacles where they stand, brought up to date by the next query after
/// a change; what has not moved stays where it is in the tree.
class BodyObstacles {
 public:
  /// @param revision Another one after every change of the bodies.
  void update(const std::deque<BodyRecord>& bodies, std::uint64_t revision);
  const ObstacleSet& set() const { return set_; }
  /// In terms of the set; lives no longer than the filter.
  ObstacleFilter filter(const std::deque<BodyRecord>& bodies, const BodyFilter& filter) const;
  std::optional<BodyId> body(const std::deque<BodyRecord>& bodies,
                             const std::optional<ObstacleId>& id) const;

 private:
  struct Entry {  // by slot
    std::optional<ObstacleId> id;
    std::shared_ptr<const Shape> shape;
    RigidPose X_WB;
  };

  ObstacleSet set_;
  std::vector<Entry> entries_;
  std::unordered_map<std::uint64_t, std::uint32_t> slots_;  // by id
  std::optional<std::uint64_t> revision_;
};

}  // namespace dyop::dynamics_internal

namespace dyop {

/// The parts of a World: bodies by slot, their near pairs, and the rules between them.
struct World::Impl {
  explicit Impl(const WorldOptions& the_options);

  // Bodies.
  dynamics_internal::BodyRecord& record(BodyId id);
  const dynamics_internal::BodyRecord& record(BodyId id) const;
  BodyId id_at(std::uint32_t slot) const { return bodies[slot].id; }
  void restart(dynamics_internal::BodyRecord& body);
  bool moves_by_itself(const dynamics_internal::BodyRecord& body,
                       const TimeInterval& interval) const;

  // Pairs.
  dynamics_internal::PairLengths lengths_of(dynamics_internal::PairKey key) const;
  bool is_pair_enabled(dynamics_internal::PairKey key) const;
  Material material_of(dynamics_internal::PairKey key) const;
  /// Takes the pairs' materials anew, of one body, and wakes those in contact.
  void renew_materials(std::uint32_t slot);
  /// Pairs of a body that changes are found anew; what touched it wakes.
  void renew_pairs_of(std::uint32_t slot);
  /// With another definition, at the same pose and velocity.
  void remake(dynamics_internal::BodyRecord& body, BodyDefinition definition);
  dynamics_internal::JointState& joint_at(JointId id);
  dynamics_internal::SpringState& spring_at(SpringId id);
  void find_links();
  /// Those that `is_removed` accepts, and the couplings of their coordinates, whose bodies wake.
  void remove_joints(const std::function<bool(const dynamics_internal::JointState&)>& is_removed);
  /// Those that bore more than they can in the step of length h that was committed.
  void break_joints(const std::vector<dynamics_internal::Island>& islands, AdvanceReport& report);
  void forget_pair(dynamics_internal::PairKey key);
  void rouse(std::uint32_t slot);
  void drop_pairs_of(std::uint32_t slot);
  PairRecord record_of(const dynamics_internal::PairState& pair) const;

  // Sleep (sleeping.cpp).
  void wake(std::uint32_t slot, AdvanceReport* report);
  void wake_what_changed(const TimeInterval& interval, AdvanceReport& report);
  void put_to_sleep(const std::vector<dynamics_internal::Island>& islands,
                    const std::vector<dynamics_internal::IslandOutcome>& outcomes, Scalar h,
                    AdvanceReport& report);

  struct SleepLimit {
    Scalar speed = 0;  // below which a body is slow
    Scalar steps = 0;  // after so many slow ones an island sleeps, balanced or not
  };
  SleepLimit sleep_limit(const dynamics_internal::Island& island, Scalar h) const;
  bool is_held(const dynamics_internal::Island& island, Scalar h) const;
  bool is_balanced(const dynamics_internal::Island& island, Scalar h);
  bool add_static_contacts(const dynamics_internal::Island& island, Scalar h,
                           ContactProblem& problem) const;
  void fall_asleep(dynamics_internal::BodyRecord& body);

  void tell_contacts(const std::vector<dynamics_internal::IslandOutcome>& outcomes,
                     AdvanceReport& report);
  // Sensors.
  void sense(const CommittedStep& step, AdvanceReport& report);
  void end_overlaps(const std::set<dynamics_internal::PairKey>& lost, Scalar t,
                    AdvanceReport& report);

  AdvanceReport advance(Scalar dt, const AdvanceLimits& limits);
  void advance_steps(Scalar dt, const AdvanceLimits& limits, AdvanceReport& report);
  void answer_by_callback(AdvanceReport& report);
  /// Records a change of a body's state that no impulse explains.
  void note_set(const dynamics_internal::BodyRecord& body, AdvanceReport* report);
  /// Adopts a step that was proven.
  void commit(const dynamics_internal::Ledger& ledger,
              const std::vector<dynamics_internal::Island>& islands,
              std::vector<dynamics_internal::IslandOutcome>& outcomes, AdvanceReport& report);
  void commit_unmoved(CommittedStep& step);
  void commit_islands(const std::vector<dynamics_internal::Island>& islands,
                      std::vector<dynamics_internal::IslandOutcome>& outcomes, CommittedStep& step);
  void add_impacts(const std::vector<dynamics_internal::IslandOutcome>& outcomes,
                   AdvanceReport& report) const;
  void commit_pairs(const dynamics_internal::Ledger& ledger, AdvanceReport& report);

  WorldOptions options;
  Vector3 gravity_W;
  Scalar time = 0;
  std::deque<dynamics_internal::BodyRecord> bodies;
  std::vector<std::uint32_t> free_slots;
  std::size_t count = 0;
  dynamics_internal::BroadPhase broad_phase;
  std::vector<std::unique_ptr<dynamics_internal::PairState>> pairs;  // by key
  std::map<dynamics_internal::PairKey, bool> pair_enabled;
  std::map<dynamics_internal::PairKey, Scalar> pair_target;
  std::map<dynamics_internal::PairKey, Material> pair_material;
  std::vector<dynamics_internal::PairKey> touching;  // sorted: told to have begun
  std::deque<dynamics_internal::JointState> joints;  // by id
  std::uint64_t next_joint = 0;
  std::deque<dynamics_internal::SpringState> springs;  // by id
  std::uint64_t next_spring = 0;
  std::uint64_t rules_version = 0;
  bool has_filters = false;                        // of some body, once
  std::vector<VelocityChange> changes_before;      // since the last advance
  std::vector<BodyId> placed;                      // the same
  std::vector<dynamics_internal::PairKey> links;   // bodies of joints and springs
  std::vector<dynamics_internal::PairKey> joined;  // sorted: pairs that joints do not let collide
  std::set<dynamics_internal::PairKey> overlapping_sensors;
  std::set<dynamics_internal::PairKey> crossed;  // already reported
  dynamics_internal::BodyObstacles obstacles;    // for queries
  std::uint64_t revision = 0;                    // of poses, shapes and presence of the bodies
  std::vector<std::unique_ptr<dynamics_internal::StepWorkspace>> workspaces;
  dynamics_internal::StepMemory memory;
};

}  // namespace dyop
