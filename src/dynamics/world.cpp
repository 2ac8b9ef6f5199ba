// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/dynamics/world.h"

#include <algorithm>
#include <map>

#include "core/tolerance.h"
#include "dynamics/free_flight.h"
#include "dynamics/world_impl.h"
#include "dyop/core/error.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/rest_motion.h"
#include "dyop/motion/sequence_motion.h"

namespace dyop {

using dynamics_internal::BodyRecord;
using dynamics_internal::PairKey;

namespace {

void require_valid(const WorldOptions& options) {
  DYOP_REQUIRE(options.gravity_W.allFinite(), "World: gravity must be finite, not (",
               options.gravity_W.transpose(), ")");
  const auto require_positive = [](const std::optional<Scalar>& value, const char* what) {
    DYOP_REQUIRE(!value || (*value > 0 && *value < kInfinity), "World: ", what,
                 " must be finite and > 0, not ", *value);
  };
  require_positive(options.max_step, "max_step");
  require_positive(options.rest_offset, "rest_offset");
  require_positive(options.separation_speed, "separation_speed");
  DYOP_REQUIRE(!options.target_distance ||
                   (*options.target_distance >= 0 && *options.target_distance < kInfinity),
               "World: target_distance must be finite and >= 0, not ", *options.target_distance);
  DYOP_REQUIRE(!options.restitution_speed || *options.restitution_speed >= 0,
               "World: restitution_speed must be >= 0, not ", *options.restitution_speed);
  DYOP_REQUIRE(!options.sleep_speed || *options.sleep_speed >= 0,
               "World: sleep_speed must be >= 0, not ", *options.sleep_speed);
  DYOP_REQUIRE(options.max_node_pairs > 0, "World: max_node_pairs must be > 0, not ",
               options.max_node_pairs);
  DYOP_REQUIRE(options.thread_count >= 0, "World: thread_count must be >= 0, not ",
               options.thread_count);
  DYOP_REQUIRE(options.policy != ImpactPolicy::Callback || options.on_impact,
               "World: policy Callback needs on_impact");
}

void require_two(BodyId a, BodyId b) {
  DYOP_REQUIRE(a != b, "World: a pair needs two different bodies, not ", a, " twice");
}

}  // namespace

World::World(const WorldOptions& options) : impl_(std::make_unique<Impl>(options)) {
  require_valid(options);
}

World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

BodyId World::add_body(const BodyDefinition& definition) {
  dynamics_internal::require_valid(definition);
  Impl& impl = *impl_;
  const bool is_new = impl.free_slots.empty();
  const std::uint32_t slot =
      is_new ? static_cast<std::uint32_t>(impl.bodies.size()) : impl.free_slots.back();
  const BodyId id(slot, is_new ? 0 : impl.bodies[slot].id.generation + 1);
  BodyRecord body = dynamics_internal::make_body_record(id, definition, impl.time);
  if (is_new) {
    impl.bodies.push_back(std::move(body));
    impl.broad_phase.add(AlignedBox());
  } else {
    impl.free_slots.pop_back();
    impl.bodies[slot] = std::move(body);
  }
  ++impl.count;
  return id;
}

void World::remove_body(BodyId id) {
  set_enabled(id, false);
  std::erase_if(impl_->joints, [&](const auto& joint) {
    return joint.definition.a == id || joint.definition.b == id;
  });
  std::erase_if(impl_->springs, [&](const auto& spring) {
    return spring.definition.a == id || spring.definition.b == id;
  });
  impl_->find_links();
  BodyRecord& body = impl_->record(id);
  body.exists = false;
  body.definition.user_data.reset();
  impl_->free_slots.push_back(id.slot);
  std::erase_if(impl_->pair_enabled, [&](const auto& entry) {
    return entry.first.a == id.slot || entry.first.b == id.slot;
  });
  std::erase_if(impl_->pair_target, [&](const auto& entry) {
    return entry.first.a == id.slot || entry.first.b == id.slot;
  });
  --impl_->count;
}

void World::set_enabled(BodyId id, bool is_enabled) {
  BodyRecord& body = impl_->record(id);
  if (body.is_enabled == is_enabled) return;
  for (const auto& pair : impl_->pairs) {
    if (!pair->has_contacts) continue;
    if (pair->key.a == id.slot) impl_->wake(pair->key.b, nullptr);
    if (pair->key.b == id.slot) impl_->wake(pair->key.a, nullptr);
  }
  impl_->drop_pairs_of(id.slot);
  body.is_enabled = is_enabled;
  body.is_asleep = false;
  if (body.definition.kind == BodyKind::Kinematic && is_enabled) {
    body.state = central_state(body, body.definition.motion->state(impl_->time));
  }
  impl_->restart(body);
  if (is_enabled) impl_->note_set(body, nullptr);
  impl_->broad_phase.update(static_cast<std::int32_t>(id.slot), AlignedBox());
}

void World::set_motion(BodyId id, std::shared_ptr<const Motion> motion) {
  BodyRecord& body = impl_->record(id);
  const auto& name = body.definition.name;
  DYOP_REQUIRE(body.definition.kind == BodyKind::Kinematic, "body '", name,
               "': only a kinematic body can have a motion");
  DYOP_REQUIRE(motion != nullptr, "body '", name, "': the motion is missing");
  DYOP_REQUIRE(motion->domain().contains(impl_->time), "body '", name,
               "': its motion is not defined at t = ", impl_->time);
  const MotionState state = motion->state(impl_->time);
  const RigidPose X_WB = body.X_WB();
  const Scalar radius = body.definition.shape->bounding_radius();
  const Scalar jump = (state.X_WB.translation() - X_WB.translation()).norm() +
                      radius * (state.X_WB.rotation() - X_WB.rotation()).norm();
  constexpr Scalar kLargestJump = 1e-3;  // of the radius, as documented
  DYOP_REQUIRE(jump <= kLargestJump * radius, "body '", name, "': its new motion starts ", jump,
               " away from the body; use a motion to move it there");
  if (jump > 0) {
    impl_->placed.push_back(id);
    for (const auto& pair : impl_->pairs) {
      if (pair->key.a != id.slot && pair->key.b != id.slot) continue;
      pair->start_from_committed();
      pair->loosen_bounds(2 * jump);
      pair->commit_bounds();
    }
  }
  body.definition.motion = std::move(motion);
  body.state = central_state(body, state);
  impl_->restart(body);
}

void World::set_next_pose(BodyId id, const RigidPose& X_WB, Scalar t) {
  const BodyRecord& body = impl_->record(id);
  const Scalar now = impl_->time;
  DYOP_REQUIRE(t > now && t < kInfinity, "body '", body.definition.name,
               "': the time of its next pose must be finite and > ", now, ", not ", t);
  constexpr Scalar kRestSpans = 1e9;
  const TimeInterval move{now, t};
  const TimeInterval rest{t, t + kRestSpans * (t - now)};
  set_motion(id, std::make_shared<SequenceMotion>(std::vector<SequenceMotion::Part>{
                     {move, std::make_shared<InterpolatedMotion>(move, body.X_WB(), X_WB)},
                     {rest, std::make_shared<RestMotion>(X_WB)}}));
}

void World::set_state(BodyId id, const MotionState& state) {
  BodyRecord& body = impl_->record(id);
  const auto& name = body.definition.name;
  DYOP_REQUIRE(body.is_dynamic(), "body '", name, "': only the state of a dynamic body can be set");
  DYOP_REQUIRE(state.twist.v_WB.allFinite() && state.twist.w_WB.allFinite(), "body '", name,
               "': velocity must be finite");
  wake(id);
  const RigidPose X_WB = body.X_WB();
  const bool moves =
      X_WB.translation() != state.X_WB.translation() || X_WB.rotation() != state.X_WB.rotation();
  if (moves) {
    for (const auto& pair : impl_->pairs) {
      if (!pair->has_contacts) continue;
      if (pair->key.a == id.slot) impl_->wake(pair->key.b, nullptr);
      if (pair->key.b == id.slot) impl_->wake(pair->key.a, nullptr);
    }
    impl_->drop_pairs_of(id.slot);
    impl_->placed.push_back(id);
  }
  body.state = central_state(body, state);
  impl_->restart(body);
  impl_->note_set(body, nullptr);
}

void World::set_wrench(BodyId id, WrenchCallback wrench) {
  BodyRecord& body = impl_->record(id);
  DYOP_REQUIRE(body.is_dynamic(), "body '", body.definition.name,
               "': only a dynamic body can have a wrench");
  body.definition.wrench = std::move(wrench);
  body.flight = nullptr;
  wake(id);
}

void World::set_material(BodyId id, const Material& material) {
  BodyRecord& body = impl_->record(id);
  BodyDefinition changed = body.definition;
  changed.restitution = material.restitution;
  changed.friction = material.friction;
  changed.rolling_friction = material.rolling_friction;
  changed.torsional_friction = material.torsional_friction;
  dynamics_internal::require_material(changed);
  body.definition = std::move(changed);
  for (const auto& pair : impl_->pairs) {
    if (!pair->has_contacts || (pair->key.a != id.slot && pair->key.b != id.slot)) continue;
    impl_->wake(pair->key.a, nullptr);
    impl_->wake(pair->key.b, nullptr);
  }
}

void World::set_gravity(const Vector3& gravity_W) {
  DYOP_REQUIRE(gravity_W.allFinite(), "World: gravity must be finite, not (", gravity_W.transpose(),
               ")");
  impl_->gravity_W = gravity_W;
  ++impl_->rules_version;
  for (BodyRecord& body : impl_->bodies) {
    if (!body.is_present() || !body.is_dynamic()) continue;
    body.is_asleep = false;
    impl_->restart(body);
  }
}

void World::wake(BodyId id) {
  BodyRecord& body = impl_->record(id);
  DYOP_REQUIRE(body.is_dynamic(), "body '", body.definition.name,
               "': only a dynamic body can be woken");
  impl_->wake(id.slot, nullptr);
}

void World::set_pair_enabled(BodyId a, BodyId b, bool is_enabled) {
  impl_->record(a);
  impl_->record(b);
  require_two(a, b);
  const PairKey key = dynamics_internal::ordered(a.slot, b.slot);
  impl_->pair_enabled[key] = is_enabled;
  ++impl_->rules_version;
  std::erase_if(impl_->pairs, [&](const auto& pair) {
    if (pair->key != key) return false;
    if (pair->has_contacts) {
      impl_->wake(key.a, nullptr);
      impl_->wake(key.b, nullptr);
    }
    return true;
  });
}

void World::set_target_distance(BodyId a, BodyId b, Scalar target_distance) {
  impl_->record(a);
  impl_->record(b);
  require_two(a, b);
  DYOP_REQUIRE(target_distance >= 0 && target_distance < kInfinity,
               "World: target_distance must be finite and >= 0, not ", target_distance);
  const PairKey key = dynamics_internal::ordered(a.slot, b.slot);
  set_pair_enabled(a, b, impl_->is_pair_enabled(key));  // wakes both, forgets the pair
  impl_->pair_target[key] = target_distance;
}

std::vector<World::PairRule> World::pair_rules() const {
  std::map<PairKey, PairRule> rules;
  const auto rule_of = [&](const PairKey& key) -> PairRule& {
    PairRule& rule = rules[key];
    rule.a = impl_->id_at(key.a);
    rule.b = impl_->id_at(key.b);
    return rule;
  };
  for (const auto& [key, is_enabled] : impl_->pair_enabled) rule_of(key).is_enabled = is_enabled;
  for (const auto& [key, target] : impl_->pair_target) rule_of(key).target_distance = target;
  std::vector<PairRule> all;
  for (const auto& [key, rule] : rules) all.push_back(rule);
  return all;
}

const WorldOptions& World::options() const {
  return impl_->options;
}

Vector3 World::gravity() const {
  return impl_->gravity_W;
}

std::vector<JointId> World::joints() const {
  std::vector<JointId> ids;
  for (const auto& joint : impl_->joints) ids.push_back(joint.id);
  return ids;
}

std::vector<SpringId> World::springs() const {
  std::vector<SpringId> ids;
  for (const auto& spring : impl_->springs) ids.push_back(spring.id);
  return ids;
}

std::uint64_t World::rules_version() const {
  return impl_->rules_version;
}

Scalar World::time() const {
  return impl_->time;
}

std::size_t World::body_count() const {
  return impl_->count;
}

std::vector<BodyId> World::bodies() const {
  std::vector<BodyId> ids;
  for (const BodyRecord& body : impl_->bodies) {
    if (body.exists) ids.push_back(body.id);
  }
  return ids;
}

bool World::has_body(BodyId id) const {
  return id.slot < impl_->bodies.size() && impl_->bodies[id.slot].exists &&
         impl_->bodies[id.slot].id == id;
}

const BodyDefinition& World::body(BodyId id) const {
  return impl_->record(id).definition;
}

std::any& World::user_data(BodyId id) {
  return impl_->record(id).definition.user_data;
}

MotionState World::state(BodyId id) const {
  return impl_->record(id).motion_state();
}

bool World::is_asleep(BodyId id) const {
  return impl_->record(id).is_asleep;
}

bool World::is_enabled(BodyId id) const {
  return impl_->record(id).is_enabled;
}

std::vector<PairRecord> World::pairs() const {
  std::vector<PairRecord> records;
  for (const auto& pair : impl_->pairs) records.push_back(impl_->record_of(*pair));
  return records;
}

std::vector<PairRecord> World::contacts() const {
  std::vector<PairRecord> records;
  for (const auto& pair : impl_->pairs) {
    if (pair->has_contacts) records.push_back(impl_->record_of(*pair));
  }
  return records;
}

Scalar World::kinetic_energy() const {
  Scalar energy = 0;
  for (const BodyRecord& body : impl_->bodies) {
    if (body.is_present()) energy += body.kinetic_energy();
  }
  return energy;
}

Vector3 World::momentum() const {
  Vector3 sum = Vector3::Zero();
  for (const BodyRecord& body : impl_->bodies) {
    if (!body.is_present() || !body.is_dynamic()) continue;
    sum += body.definition.mass_properties.mass * body.state.v_W;
  }
  return sum;
}

Vector3 World::angular_momentum() const {
  Vector3 sum = Vector3::Zero();
  for (const BodyRecord& body : impl_->bodies) {
    if (!body.is_present() || !body.is_dynamic()) continue;
    const Vector3 momentum = body.definition.mass_properties.mass * body.state.v_W;
    sum += body.state.X_WM.translation().cross(momentum) + body.state.L_W;
  }
  return sum;
}

AdvanceReport World::advance(Scalar dt, const AdvanceLimits& limits) {
  return impl_->advance(dt, limits);
}

// Joints and springs: what acts between two bodies besides contact.

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
  ++impl_->rules_version;
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
