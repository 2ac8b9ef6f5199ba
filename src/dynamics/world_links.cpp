// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "dynamics/free_flight.h"
#include "dynamics/world_impl.h"
#include "dyop/core/error.h"

// Joints and springs: what acts between two bodies besides contact.
namespace dyop {

using dynamics_internal::BodyRecord;
using dynamics_internal::PairKey;

JointId World::add_joint(const JointDefinition& definition) {
  dynamics_internal::require_valid(definition);
  const BodyRecord& a = impl_->record(definition.a);
  const BodyRecord& b = impl_->record(definition.b);
  DYOP_REQUIRE(a.is_dynamic() || b.is_dynamic(), "joint '", definition.name,
               "': one of its bodies must be dynamic");
  dynamics_internal::JointState joint;
  joint.id = {impl_->next_joint++};
  joint.definition = definition;
  if (definition.kind == JointKind::Distance && !definition.limits) {
    const Vector3 p_WJa = a.X_WB() * definition.X_AJ.translation();
    const Vector3 p_WJb = b.X_WB() * definition.X_BJ.translation();
    const Scalar distance = (p_WJb - p_WJa).norm();
    joint.definition.limits = JointLimits{distance, distance};
    dynamics_internal::require_valid(joint.definition);
  }
  impl_->joints.push_back(std::move(joint));
  impl_->find_links();
  forget_pair(definition.a, definition.b);
  return impl_->joints.back().id;
}

void World::remove_joint(JointId id) {
  const JointDefinition definition = impl_->joint_at(id).definition;
  std::erase_if(impl_->joints, [&](const auto& joint) { return joint.id == id; });
  impl_->find_links();
  forget_pair(definition.a, definition.b);
}

void World::set_motor(JointId id, const JointMotor& motor) {
  dynamics_internal::JointState& joint = impl_->joint_at(id);
  DYOP_REQUIRE(joint.definition.motor.has_value(), "joint '", joint.definition.name,
               "': has no motor");
  JointDefinition changed = joint.definition;
  changed.motor = motor;
  dynamics_internal::require_valid(changed);
  joint.definition = changed;
  impl_->wake(changed.a.slot, nullptr);
  impl_->wake(changed.b.slot, nullptr);
}

const JointDefinition& World::joint(JointId id) const {
  return impl_->joint_at(id).definition;
}

SpringId World::add_spring(const SpringDefinition& definition) {
  dynamics_internal::require_valid(definition);
  const BodyRecord& a = impl_->record(definition.a);
  const BodyRecord& b = impl_->record(definition.b);
  DYOP_REQUIRE(a.is_dynamic() || b.is_dynamic(), "spring '", definition.name,
               "': one of its bodies must be dynamic");
  dynamics_internal::SpringState spring;
  spring.id = {impl_->next_spring++};
  spring.definition = definition;
  if (!definition.rest_length) {
    spring.definition.rest_length =
        dynamics_internal::spring_vector(definition, a.X_WB(), b.X_WB()).norm();
  }
  impl_->springs.push_back(std::move(spring));
  impl_->find_links();
  rouse(definition.a, definition.b);
  return impl_->springs.back().id;
}

void World::remove_spring(SpringId id) {
  const SpringDefinition definition = impl_->spring_at(id).definition;
  std::erase_if(impl_->springs, [&](const auto& spring) { return spring.id == id; });
  impl_->find_links();
  rouse(definition.a, definition.b);
}

const SpringDefinition& World::spring(SpringId id) const {
  return impl_->spring_at(id).definition;
}

Scalar World::spring_energy() const {
  Scalar energy = 0;
  for (const dynamics_internal::SpringState& spring : impl_->springs) {
    const BodyRecord& a = impl_->record(spring.definition.a);
    const BodyRecord& b = impl_->record(spring.definition.b);
    if (!a.is_present() || !b.is_present()) continue;
    energy += dynamics_internal::spring_energy(
        spring, dynamics_internal::spring_vector(spring.definition, a.X_WB(), b.X_WB()));
  }
  return energy;
}

// After a change to the rules between two bodies: both wake up.
void World::forget_pair(BodyId a, BodyId b) {
  const PairKey key = dynamics_internal::ordered(a.slot, b.slot);
  std::erase_if(impl_->pairs, [&](const auto& pair) { return pair->key == key; });
  rouse(a, b);
}

void World::rouse(BodyId a, BodyId b) {
  for (const BodyId id : {a, b}) {
    impl_->wake(id.slot, nullptr);
    impl_->bodies[id.slot].flight = nullptr;
  }
}

}  // namespace dyop
