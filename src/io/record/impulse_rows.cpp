// SPDX-License-Identifier: BSD-3-Clause
#include "io/record/impulse_rows.h"

#include <algorithm>

#include "dyop/core/error.h"
#include "io/record/event_rows.h"

namespace dyop::io_internal {
namespace {

KnownMomentum& known_of(std::vector<KnownMomentum>& known, std::size_t slot) {
  if (slot >= known.size()) known.resize(slot + 1);
  return known[slot];
}

}  // namespace

VelocityChangeRows rows_of(const VelocityChange& change, std::vector<KnownMomentum>& known,
                           const std::vector<bool>& has_wrench) {
  VelocityChangeRows rows;
  for (const MomentumChange& body : change.bodies) {
    const std::uint32_t slot = body.body.slot;
    KnownMomentum& last = known_of(known, slot);
    // What a Set found before it does not count.
    const bool is_last =
        change.kind == VelocityChangeKind::Set ||
        (last.is_known && last.v_W == body.v_before_W && last.L_W == body.L_before_W);
    if (!is_last)
      rows.momenta.push_back({slot, 1, row_of(body.v_before_W), row_of(body.L_before_W)});
    rows.momenta.push_back({slot, 0, row_of(body.v_W), row_of(body.L_W)});
    last = {true, body.v_W, body.L_W};
    if (slot < has_wrench.size() && has_wrench[slot]) {
      rows.wrenches.push_back({slot, 0, row_of(body.impulse_W), row_of(body.angular_impulse_W)});
    }
  }
  for (const ContactImpulse& contact : change.contacts) {
    rows.contacts.push_back({contact.a.slot, contact.b.slot, row_of(contact.p_W),
                             row_of(contact.nhat_AB_W), row_of(contact.impulse_W), contact.target,
                             contact.friction});
  }
  for (const LinkImpulse& link : change.links) {
    rows.links.push_back({static_cast<std::uint32_t>(link.kind), link.a.slot, link.b.slot, 0,
                          row_of(link.impulse_W), row_of(link.angular_a_W),
                          row_of(link.angular_b_W)});
  }
  return rows;
}

VelocityChange change_from(const VelocityChangeRow& row, const VelocityChangeRows& rows,
                           std::vector<KnownMomentum>& known) {
  VelocityChange change;
  DYOP_REQUIRE(row.kind <= static_cast<std::uint32_t>(VelocityChangeKind::Set),
               "a velocity change of the unknown kind ", row.kind);
  change.kind = static_cast<VelocityChangeKind>(row.kind);
  change.interval = {row.begin, row.end};
  for (const MomentumRow& momentum : rows.momenta) {
    KnownMomentum& last = known_of(known, momentum.body);
    if (momentum.is_before == 0) {
      MomentumChange& body = change.bodies.emplace_back();
      body.body = BodyId(momentum.body);
      body.v_before_W = last.v_W;
      body.L_before_W = last.L_W;
      body.v_W = vector_of(momentum.v);
      body.L_W = vector_of(momentum.L);
    }
    last = {true, vector_of(momentum.v), vector_of(momentum.L)};
  }
  for (const WrenchImpulseRow& wrench : rows.wrenches) {
    const auto body =
        std::find_if(change.bodies.begin(), change.bodies.end(),
                     [&](const MomentumChange& other) { return other.body.slot == wrench.body; });
    DYOP_REQUIRE(body != change.bodies.end(), "the wrench of a body that does not change");
    body->impulse_W = vector_of(wrench.impulse);
    body->angular_impulse_W = vector_of(wrench.angular);
  }
  for (const ContactImpulseRow& contact : rows.contacts) {
    change.contacts.push_back({BodyId(contact.a), BodyId(contact.b), vector_of(contact.p),
                               vector_of(contact.normal), vector_of(contact.impulse),
                               contact.target, contact.friction});
  }
  for (const LinkImpulseRow& link : rows.links) {
    DYOP_REQUIRE(link.kind <= static_cast<std::uint32_t>(LinkImpulse::Kind::Rolling),
                 "an impulse of the unknown kind ", link.kind);
    change.links.push_back({static_cast<LinkImpulse::Kind>(link.kind), BodyId(link.a),
                            BodyId(link.b), vector_of(link.impulse), vector_of(link.angular_a),
                            vector_of(link.angular_b)});
  }
  return change;
}

}  // namespace dyop::io_internal
