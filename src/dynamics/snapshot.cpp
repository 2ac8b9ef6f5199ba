// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/free_flight.h"
#include "dynamics/world_impl.h"
#include "dyop/core/error.h"

namespace dyop {

struct WorldSnapshot::State {
  const void* world = nullptr;  // the World it was taken from
  Vector3 gravity_W;
  Scalar time = 0;
  std::deque<dynamics_internal::BodyRecord> bodies;
  std::vector<std::uint32_t> free_slots;
  std::size_t count = 0;
  dynamics_internal::BroadPhase broad_phase;
  std::vector<dynamics_internal::PairState> pairs;
  std::map<dynamics_internal::PairKey, bool> pair_enabled;
  std::map<dynamics_internal::PairKey, Scalar> pair_target;
  std::deque<dynamics_internal::JointState> joints;
  std::uint64_t next_joint = 0;
  std::deque<dynamics_internal::SpringState> springs;
  std::uint64_t next_spring = 0;
  std::set<dynamics_internal::PairKey> overlapping_sensors;
  std::set<dynamics_internal::PairKey> crossed;
};

WorldSnapshot World::snapshot() {
  auto state = std::make_shared<WorldSnapshot::State>();
  for (dynamics_internal::BodyRecord& body : impl_->bodies) body.flight = nullptr;
  state->world = impl_.get();
  state->gravity_W = impl_->gravity_W;
  state->time = impl_->time;
  state->bodies = impl_->bodies;
  state->free_slots = impl_->free_slots;
  state->count = impl_->count;
  state->broad_phase = impl_->broad_phase;
  for (const auto& pair : impl_->pairs) state->pairs.push_back(*pair);
  state->pair_enabled = impl_->pair_enabled;
  state->pair_target = impl_->pair_target;
  state->joints = impl_->joints;
  state->next_joint = impl_->next_joint;
  state->springs = impl_->springs;
  state->next_spring = impl_->next_spring;
  state->overlapping_sensors = impl_->overlapping_sensors;
  state->crossed = impl_->crossed;
  WorldSnapshot snapshot;
  snapshot.state_ = std::move(state);
  return snapshot;
}

void World::restore(const WorldSnapshot& snapshot) {
  DYOP_REQUIRE(snapshot.state_ && snapshot.state_->world == impl_.get(),
               "World: the snapshot is of another World");
  const WorldSnapshot::State& state = *snapshot.state_;
  impl_->gravity_W = state.gravity_W;
  impl_->time = state.time;
  impl_->bodies = state.bodies;
  impl_->free_slots = state.free_slots;
  impl_->count = state.count;
  impl_->broad_phase = state.broad_phase;
  impl_->pairs.clear();
  for (const dynamics_internal::PairState& pair : state.pairs) {
    impl_->pairs.push_back(std::make_unique<dynamics_internal::PairState>(pair));
  }
  impl_->pair_enabled = state.pair_enabled;
  impl_->pair_target = state.pair_target;
  impl_->joints = state.joints;
  impl_->next_joint = state.next_joint;
  impl_->springs = state.springs;
  impl_->next_spring = state.next_spring;
  impl_->find_links();
  impl_->overlapping_sensors = state.overlapping_sensors;
  impl_->crossed = state.crossed;
}

}  // namespace dyop
