#include <algorithm>
#include <cmath>

#include "dynamics/impact_law.h"
#include "dynamics/local_contacts.h"
#include "dynamics/world_impl.h"
#include "dyop/core/error.h"

namespace dyop {
namespace {

using internal::BodyRecord;
using internal::ImpactBody;
using internal::ImpactPoint;

// Height above the margin to which slow contacts hop, well within the band in which the impact
// engine speaks of contact, and the least hop of one that is there already; in tolerances.
constexpr Scalar kHopHeight = 0.9;
constexpr Scalar kLeastHop = 0.1;

std::size_t index_of(BodyId id) {
  return static_cast<std::size_t>(id);
}

Vector3 point_velocity(const MotionState& state, const Vector3& p_W) {
  return state.twist.v_WB + state.twist.w_WB.cross(p_W - state.X_WB.translation());
}

Scalar gap_velocity(const Contact& contact, const MotionState& a, const MotionState& b) {
  return contact.nhat_AB_W.dot(point_velocity(b, contact.p_WCb) - point_velocity(a, contact.p_WCa));
}

ImpactBody impact_body(const BodyRecord& body) {
  ImpactBody impact;
  impact.p_WBcm = body.center_of_mass();
  impact.v_WBcm = body.center_velocity();
  impact.w_WB = body.state.twist.w_WB;
  if (body.is_active()) {
    impact.inverse_mass = 1 / body.definition.mass_properties.mass;
    impact.inverse_inertia_W = body.inertia_W().inverse();
  }
  return impact;
}

}  // namespace

std::vector<WorldContact> World::Impl::gather_contacts(const std::vector<BodyPair>& pairs) const {
  std::vector<WorldContact> contacts;
  const auto add = [&](const BodyPair& pair, const Contact& contact) {
    WorldContact world_contact;
    world_contact.a = pair.first;
    world_contact.b = pair.second;
    world_contact.contact = contact;
    world_contact.normal_velocity = gap_velocity(contact, bodies[index_of(pair.first)].state,
                                                 bodies[index_of(pair.second)].state);
    contacts.push_back(world_contact);
  };
  for (const BodyPair& pair : pairs) {
    const BodyRecord& a = bodies[index_of(pair.first)];
    const BodyRecord& b = bodies[index_of(pair.second)];
    // Twice the tolerance: what lands within one tolerance of the first contact lands with it.
    const Scalar reach = margin(pair.first, pair.second) + 2 * tolerance();
    const Shape& shape_a = *a.definition.shape;
    const Shape& shape_b = *b.definition.shape;
    const std::vector<Contact> found =
        internal::local_contacts(find_contacts(shape_a, a.state.X_WB, shape_b, b.state.X_WB, reach),
                                 shape_a, a.state.X_WB, shape_b, b.state.X_WB, reach);
    for (const Contact& contact : found) add(pair, contact);
  }
  return contacts;
}

// A settled body that is struck faster than the Zeno speed moves again.
void World::Impl::wake_struck_bodies(const std::vector<WorldContact>& contacts) {
  for (const WorldContact& contact : contacts) {
    if (!(contact.normal_velocity < -options.zeno_speed)) continue;
    for (const BodyId id : {contact.a, contact.b}) {
      BodyRecord& body = bodies[index_of(id)];
      if (body.is_settled) body.impact_times.clear();
      body.is_settled = false;
    }
  }
}

void World::Impl::apply_impulses(std::vector<WorldContact>& contacts) {
  std::vector<ImpactBody> impact_bodies;
  for (const BodyRecord& body : bodies) impact_bodies.push_back(impact_body(body));
  // Every contact parts at least so fast that it hops to a fixed height within the tolerance: so
  // time goes on, and the gap does not creep. The Zeno guard ends such hopping.
  const auto hop_speed = [&](const WorldContact& contact) {
    const Scalar height = contact.contact.lower - margin(contact.a, contact.b);
    const Scalar rise = tolerance() * std::max(kHopHeight - height / tolerance(), kLeastHop);
    return std::sqrt(2 * options.gravity_W.norm() * rise);
  };
  std::vector<ImpactPoint> points;
  for (const WorldContact& contact : contacts) {
    const BodyDefinition& a = bodies[index_of(contact.a)].definition;
    const BodyDefinition& b = bodies[index_of(contact.b)].definition;
    ImpactPoint point;
    point.a = index_of(contact.a);
    point.b = index_of(contact.b);
    point.p_WCa = contact.contact.p_WCa;
    point.p_WCb = contact.contact.p_WCb;
    point.nhat_AB_W = contact.contact.nhat_AB_W;
    const bool is_fast = contact.normal_velocity < -options.zeno_speed;
    point.restitution = is_fast ? std::min(a.restitution, b.restitution) : 0;
    point.least_rebound = contact.normal_velocity < 0 ? hop_speed(contact) : 0;
    point.friction = std::sqrt(a.friction * b.friction);
    points.push_back(point);
  }
  internal::resolve_impact(impact_bodies, points);
  for (std::size_t i = 0; i < contacts.size(); ++i) contacts[i].impulse_W = points[i].impulse_W;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    BodyRecord& body = bodies[i];
    if (!body.is_active()) continue;
    body.state.twist = internal::body_state(body.definition.mass_properties,
                                            body.state.X_WB.rotation(), impact_bodies[i].p_WBcm,
                                            impact_bodies[i].v_WBcm, impact_bodies[i].w_WB)
                           .twist;
  }
}

// The Zeno guard: bodies that were in many impacts within the window, are slow in every contact and
// as a whole, and touch only bodies that do not move or settle with them.
std::vector<BodyId> World::Impl::settle_bodies(const ImpactEvent& event) {
  std::vector<bool> is_candidate(bodies.size(), false);
  std::vector<bool> was_hit(bodies.size(), false);
  for (const WorldContact& contact : event.contacts) {
    for (const BodyId id : {contact.a, contact.b}) was_hit[index_of(id)] = true;
  }
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    BodyRecord& body = bodies[i];
    if (!was_hit[i] || !body.is_active()) continue;
    body.impact_times.push_back(event.t);
    while (event.t - body.impact_times.front() > options.zeno_window) body.impact_times.pop_front();
    const Scalar speed = body.center_velocity().norm() +
                         body.state.twist.w_WB.norm() * body.definition.shape->bounding_radius();
    is_candidate[i] = static_cast<int>(body.impact_times.size()) >= options.zeno_impacts &&
                      speed <= options.zeno_speed;
  }
  const auto is_at_rest = [&](BodyId id) {
    const BodyRecord& body = bodies[index_of(id)];
    return is_candidate[index_of(id)] || body.is_settled ||
           (!body.is_active() && body.state.twist.v_WB.isZero(0) &&
            body.state.twist.w_WB.isZero(0));
  };
  // Dropping one candidate may take the ground from another: at most one round a body.
  for (std::size_t round = 0; round < bodies.size(); ++round) {
    bool has_changed = false;
    for (const WorldContact& contact : event.contacts) {
      const bool is_slow = contact.normal_velocity >= -options.zeno_speed;
      for (const auto& [id, other] :
           {BodyPair(contact.a, contact.b), BodyPair(contact.b, contact.a)}) {
        if (is_candidate[index_of(id)] && !(is_slow && is_at_rest(other))) {
          is_candidate[index_of(id)] = false;
          has_changed = true;
        }
      }
    }
    if (!has_changed) break;
  }
  std::vector<BodyId> settled;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (!is_candidate[i]) continue;
    bodies[i].is_settled = true;
    bodies[i].state.twist = {};
    settled.push_back(static_cast<BodyId>(i));
  }
  return settled;
}

void World::Impl::handle_impact(ImpactEvent event, const std::vector<BodyPair>& pairs,
                                AdvanceReport& report) {
  event.contacts = gather_contacts(pairs);
  if (options.policy == ImpactPolicy::Stop) {
    report.impacts.push_back(std::move(event));
    report.status = AdvanceStatus::StoppedAtImpact;
    return;
  }
  wake_struck_bodies(event.contacts);
  if (options.policy == ImpactPolicy::Callback) {
    std::vector<MotionState> states;
    for (const BodyRecord& body : bodies) states.push_back(body.state);
    options.on_impact(event, states);
    DYOP_REQUIRE(states.size() == bodies.size(), "on_impact must keep the number of states, ",
                 bodies.size(), ", not leave ", states.size());
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      if (bodies[i].is_active()) bodies[i].state = states[i];
    }
  } else {
    apply_impulses(event.contacts);
  }
  const std::vector<BodyId> settled = settle_bodies(event);
  event.settled = !settled.empty();
  report.settled.insert(report.settled.end(), settled.begin(), settled.end());
  report.impacts.push_back(std::move(event));
}

}  // namespace dyop
