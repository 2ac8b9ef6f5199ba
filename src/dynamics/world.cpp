// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/dynamics/world.h"

#include <algorithm>
#include <map>
#include <ostream>
#include <tuple>
#include <utility>

#include "core/tolerance.h"
#include "dynamics/free_flight.h"
#include "dynamics/world_impl.h"
#include "dyop/core/error.h"
#include "dyop/dynamics/advance_report.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/steady_motions.h"

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
  dyop::require_valid(options.solver);
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
  ++impl.revision;
  impl.has_filters |= definition.filter != CollisionFilter{};
  if (impl.has_filters) ++impl.rules_version;  // pairs of this body may be left out
  return id;
}

void World::remove_body(BodyId id) {
  set_enabled(id, false);
  impl_->remove_joints([&](const dynamics_internal::JointState& joint) {
    return joint.definition.a == id || joint.definition.b == id;
  });
  std::erase_if(impl_->springs, [&](const auto& spring) {
    return spring.definition.a == id || spring.definition.b == id;
  });
  impl_->find_links();
  BodyRecord& body = impl_->record(id);
  body.exists = false;
  ++impl_->revision;
  body.definition.user_data.reset();
  impl_->free_slots.push_back(id.slot);
  std::erase_if(impl_->overlapping_sensors,
                [&](const PairKey& key) { return key.a == id.slot || key.b == id.slot; });
  std::erase_if(impl_->pair_enabled, [&](const auto& entry) {
    return entry.first.a == id.slot || entry.first.b == id.slot;
  });
  std::erase_if(impl_->pair_target, [&](const auto& entry) {
    return entry.first.a == id.slot || entry.first.b == id.slot;
  });
  std::erase_if(impl_->pair_material, [&](const auto& entry) {
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
  std::erase_if(impl_->touching,
                [&](const PairKey& key) { return key.a == id.slot || key.b == id.slot; });
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
  // A half-space reaches everywhere: it must not jump at all.
  const HalfSpace* half_space = as_half_space(*body.definition.shape);
  const Scalar radius = half_space ? std::abs(half_space->offset()) * kStepNoise
                                   : body.definition.shape->bounding_radius();
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
    impl_->renew_pairs_of(id.slot);
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
  impl_->renew_materials(id.slot);
}

void World::set_pair_material(BodyId a, BodyId b, const std::optional<Material>& material) {
  impl_->record(a);
  impl_->record(b);
  require_two(a, b);
  const PairKey key = dynamics_internal::ordered(a.slot, b.slot);
  if (material) {
    BodyDefinition checked;
    checked.name = impl_->record(a).definition.name + "' with '" + impl_->record(b).definition.name;
    checked.restitution = material->restitution;
    checked.friction = material->friction;
    checked.rolling_friction = material->rolling_friction;
    checked.torsional_friction = material->torsional_friction;
    dynamics_internal::require_material(checked);
    impl_->pair_material[key] = *material;
  } else {
    impl_->pair_material.erase(key);
  }
  impl_->renew_materials(a.slot);
  ++impl_->rules_version;
  rouse(a, b);
}

Material World::pair_material(BodyId a, BodyId b) const {
  impl_->record(a);
  impl_->record(b);
  require_two(a, b);
  return impl_->material_of(dynamics_internal::ordered(a.slot, b.slot));
}

// What a body is made of.

void World::set_mass_properties(BodyId id, const MassProperties& mass_properties) {
  BodyRecord& body = impl_->record(id);
  DYOP_REQUIRE(body.is_dynamic(), "body '", body.definition.name,
               "': only a dynamic body has mass properties");
  BodyDefinition changed = body.definition;
  changed.mass_properties = mass_properties;
  impl_->remake(body, std::move(changed));
}

void World::set_shape(BodyId id, std::shared_ptr<const Shape> shape) {
  BodyRecord& body = impl_->record(id);
  BodyDefinition changed = body.definition;
  changed.shape = std::move(shape);
  dynamics_internal::require_valid(changed);
  impl_->renew_pairs_of(id.slot);
  impl_->placed.push_back(id);
  impl_->remake(body, std::move(changed));
}

void World::set_filter(BodyId id, const CollisionFilter& filter) {
  impl_->record(id).definition.filter = filter;
  impl_->has_filters = true;
  ++impl_->rules_version;
  impl_->renew_pairs_of(id.slot);
}

void World::apply_impulse(BodyId id, const Vector3& impulse_W, const Vector3& p_W) {
  const Vector3 arm_W = p_W - impl_->record(id).state.X_WM.translation();
  apply_impulse(id, impulse_W);
  apply_angular_impulse(id, arm_W.cross(impulse_W));
}

void World::apply_impulse(BodyId id, const Vector3& impulse_W) {
  BodyRecord& body = impl_->record(id);
  const auto& name = body.definition.name;
  DYOP_REQUIRE(body.is_dynamic(), "body '", name, "': only a dynamic body takes an impulse");
  DYOP_REQUIRE(impulse_W.allFinite(), "body '", name, "': an impulse must be finite, not (",
               impulse_W.transpose(), ")");
  wake(id);
  body.state.v_W += body.linear_mobility() * impulse_W;
  impl_->restart(body);
  impl_->note_set(body, nullptr);
}

void World::apply_angular_impulse(BodyId id, const Vector3& angular_impulse_W) {
  BodyRecord& body = impl_->record(id);
  const auto& name = body.definition.name;
  DYOP_REQUIRE(body.is_dynamic(), "body '", name, "': only a dynamic body takes an impulse");
  DYOP_REQUIRE(angular_impulse_W.allFinite(), "body '", name,
               "': an angular impulse must be finite, not (", angular_impulse_W.transpose(), ")");
  wake(id);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const bool is_locked = body.definition.locked.rotation[static_cast<std::size_t>(k)];
    if (!is_locked) body.state.L_W[k] += angular_impulse_W[k];
  }
  impl_->restart(body);
  impl_->note_set(body, nullptr);
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
  const std::vector<BodyId> ids = bodies();
  const bool has_filters = std::any_of(ids.begin(), ids.end(), [&](BodyId id) {
    return impl_->record(id).definition.filter != CollisionFilter();
  });
  for (std::size_t i = 0; has_filters && i < ids.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const CollisionFilter& filter = impl_->record(ids[k]).definition.filter;
      if (filter.accepts(impl_->record(ids[i]).definition.filter)) continue;
      rule_of({ids[k].slot, ids[i].slot}).is_enabled = false;
    }
  }
  for (const auto& [key, is_enabled] : impl_->pair_enabled) rule_of(key).is_enabled = is_enabled;
  for (const auto& [key, target] : impl_->pair_target) rule_of(key).target_distance = target;
  for (const auto& [key, material] : impl_->pair_material) rule_of(key).material = material;
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

namespace {

using dynamics_internal::JointPlace;
using dynamics_internal::JointState;

// The bodies that the joints of a coupling can move; the second may be none.
void find_coupled_bodies(World::Impl& impl, JointDefinition& coupling) {
  std::vector<BodyId> fixed;
  std::vector<BodyId> movable;
  for (const JointId id : {coupling.first, coupling.second}) {
    const JointDefinition& joint = impl.joint_at(id).definition;
    DYOP_REQUIRE(joint.kind == JointKind::Hinge || joint.kind == JointKind::Slider ||
                     joint.kind == JointKind::Cylindrical || joint.kind == JointKind::Distance,
                 "joint '", coupling.name, "': couples a joint that has no coordinate, '",
                 joint.name, "'");
    for (const BodyId body : {joint.a, joint.b}) {
      const bool is_static = impl.record(body).definition.kind == BodyKind::Static;
      std::vector<BodyId>& list = is_static ? fixed : movable;
      if (std::find(list.begin(), list.end(), body) == list.end()) list.push_back(body);
    }
  }
  DYOP_REQUIRE(movable.size() <= 2, "joint '", coupling.name, "': couples joints of ",
               movable.size(), " bodies that are not static, and can move two");
  if (movable.size() < 2 && !fixed.empty()) movable.push_back(fixed.front());
  coupling.a = movable.front();
  coupling.b = movable.back();
}

Twist twist_of(const BodyRecord& body) {
  if (body.definition.kind == BodyKind::Kinematic) return {body.state.v_W, body.state.L_W};
  return {body.state.v_W, body.angular_velocity()};
}

JointPlace place_now(const World::Impl& impl, const JointState& joint) {
  const BodyRecord& a = impl.record(joint.definition.a);
  const BodyRecord& b = impl.record(joint.definition.b);
  return joint_place(joint.definition, a, a.X_WB(), b, b.X_WB(), joint.angle_committed);
}

JointValues values_now(const World::Impl& impl, const JointState& joint) {
  return joint_values(joint.definition, place_now(impl, joint),
                      twist_of(impl.record(joint.definition.a)),
                      twist_of(impl.record(joint.definition.b)));
}

// The coordinate that a coupling takes of a joint, and its rate.
std::pair<Scalar, Scalar> coupled_now(const World::Impl& impl, const JointState& joint,
                                      bool is_second) {
  const JointValues values = values_now(impl, joint);
  const JointKind kind = joint.definition.kind;
  const bool is_angle = kind == JointKind::Hinge || (kind == JointKind::Cylindrical && !is_second);
  return is_angle ? std::pair(values.angle, values.angle_rate)
                  : std::pair(values.position, values.position_rate);
}

std::pair<Scalar, Scalar> sum_now(World::Impl& impl, const JointDefinition& coupling) {
  const auto first = coupled_now(impl, impl.joint_at(coupling.first), false);
  const auto second = coupled_now(impl, impl.joint_at(coupling.second), true);
  return {first.first + coupling.ratio * second.first,
          first.second + coupling.ratio * second.second};
}

}  // namespace

JointId World::add_joint(const JointDefinition& definition) {
  JointState joint;
  joint.definition = definition;
  JointDefinition& made = joint.definition;
  if (made.kind == JointKind::Coupling) find_coupled_bodies(*impl_, made);
  dynamics_internal::require_valid(made);
  DYOP_REQUIRE(impl_->record(made.a).is_dynamic() || impl_->record(made.b).is_dynamic(), "joint '",
               made.name, "': one of its bodies must be dynamic");
  joint.id = {impl_->next_joint++};
  joint.angle_committed = place_now(*impl_, joint).angle;
  const bool holds_initial = !made.limits;
  if (holds_initial && made.kind == JointKind::Distance) {
    made.limits = JointLimits{1, 1};
    const Scalar distance = values_now(*impl_, joint).position;
    made.limits = JointLimits{distance, distance};
  }
  if (holds_initial && made.kind == JointKind::Coupling) {
    const Scalar sum = sum_now(*impl_, made).first;
    made.limits = JointLimits{sum, sum};
  }
  dynamics_internal::require_valid(made);
  const BodyId a = made.a;
  const BodyId b = made.b;
  impl_->joints.push_back(std::move(joint));
  impl_->find_links();
  forget_pair(a, b);
  return impl_->joints.back().id;
}

void World::remove_joint(JointId id) {
  const JointDefinition definition = impl_->joint_at(id).definition;
  impl_->remove_joints([&](const JointState& joint) { return joint.id == id; });
  forget_pair(definition.a, definition.b);
}

void World::set_motor(JointId id, const std::optional<JointMotor>& motor) {
  JointState& joint = impl_->joint_at(id);
  JointDefinition changed = joint.definition;
  changed.motor = motor;
  dynamics_internal::require_valid(changed);
  joint.definition = changed;
  joint.impulses.clear();
  ++impl_->rules_version;
  rouse(changed.a, changed.b);
}

const JointDefinition& World::joint(JointId id) const {
  return impl_->joint_at(id).definition;
}

JointValues World::joint_values(JointId id) const {
  const JointState& joint = impl_->joint_at(id);
  JointValues values;
  if (joint.definition.kind == JointKind::Coupling) {
    std::tie(values.position, values.position_rate) = sum_now(*impl_, joint.definition);
  } else {
    values = values_now(*impl_, joint);
  }
  values.force_W = joint.force_W;
  values.torque_W = joint.torque_W;
  values.drive = joint.drive;
  return values;
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

void World::forget_pair(BodyId a, BodyId b) {
  impl_->forget_pair(dynamics_internal::ordered(a.slot, b.slot));
}

void World::rouse(BodyId a, BodyId b) {
  impl_->rouse(a.slot);
  impl_->rouse(b.slot);
}

std::string_view name_of(AdvanceStatus status) {
  switch (status) {
    case AdvanceStatus::NotRun:
      return "NotRun";
    case AdvanceStatus::Completed:
      return "Completed";
    case AdvanceStatus::StoppedAtImpact:
      return "StoppedAtImpact";
    case AdvanceStatus::BudgetExhausted:
      return "BudgetExhausted";
    case AdvanceStatus::Blocked:
      return "Blocked";
    case AdvanceStatus::Cancelled:
      return "Cancelled";
    case AdvanceStatus::NumericalLimit:
      return "NumericalLimit";
  }
  return "NotRun";
}

std::ostream& operator<<(std::ostream& out, AdvanceStatus status) {
  return out << name_of(status);
}

std::ostream& operator<<(std::ostream& out, const AdvanceReport& report) {
  return out << report.status << ": t = " << report.t << ", " << report.steps.size() << " steps, "
             << report.impacts.size() << " impacts";
}

}  // namespace dyop
