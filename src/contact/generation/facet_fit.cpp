// SPDX-License-Identifier: BSD-3-Clause
#include "contact/generation/facet_fit.h"

#include <algorithm>
#include <cmath>

namespace dyop::contact_internal {
namespace {

// Cosine of the angle up to which normals are taken together: facets that turn more are not fine.
constexpr Scalar kFitCosine = 0.999;
// By how much neighbours may leave the straight line, of their distance, and how uneven the two
// distances may be.
constexpr Scalar kFitBend = 0.1;
constexpr Scalar kFitUneven = 3;

Vector3 middle_of(const ContactPoint& contact) {
  return (contact.p_WCa + contact.p_WCb) / 2;
}

// From the nearest contact to another, along the surface.
Vector3 way_to_other(const ContactPoint& nearest, const ContactPoint& other) {
  const Vector3 apart = middle_of(other) - middle_of(nearest);
  return apart - nearest.nhat_AB_W * nearest.nhat_AB_W.dot(apart);
}

bool is_alike(const ContactPoint& x, const ContactPoint& y) {
  return x.key.a.kind == y.key.a.kind && x.key.b.kind == y.key.b.kind &&
         x.normal_is_of_b == y.normal_is_of_b && x.nhat_AB_W.dot(y.nhat_AB_W) > kFitCosine;
}

// The nearest contact and its neighbours at the signed ways ahead > 0 and behind < 0.
struct Row {
  const ContactPoint* next = nullptr;
  const ContactPoint* last = nullptr;
  Scalar ahead = 0;
  Scalar behind = 0;
};

std::optional<Row> find_row(const ContactPoint& nearest,
                            std::span<const ContactPoint* const> near) {
  // The closest of those on one side of the nearest contact, on any if `side` is zero.
  const auto closest = [&](const Vector3& side) {
    const ContactPoint* best = nullptr;
    Scalar least = kInfinity;
    for (const ContactPoint* other : near) {
      if (other == &nearest || !is_alike(nearest, *other)) continue;
      const Vector3 to = way_to_other(nearest, *other);
      const Scalar apart = to.squaredNorm();
      if (apart == 0 || apart >= least || (!side.isZero(0) && side.dot(to) <= 0)) continue;
      best = other;
      least = apart;
    }
    return best;
  };
  Row row;
  row.next = closest(Vector3::Zero());
  if (!row.next) return std::nullopt;
  const Vector3 to_next = way_to_other(nearest, *row.next);
  row.last = closest(-to_next);
  if (!row.last) return std::nullopt;
  row.ahead = to_next.norm();
  const Vector3 along = to_next / row.ahead;
  row.behind = along.dot(way_to_other(nearest, *row.last));
  if (!(-row.behind <= kFitUneven * row.ahead)) return std::nullopt;
  const bool is_row = std::all_of(near.begin(), near.end(), [&](const ContactPoint* other) {
    const Vector3 to = way_to_other(nearest, *other);
    const Scalar apart = to.norm();
    return apart > -1.5 * row.behind || (to - along * along.dot(to)).norm() <= kFitBend * apart;
  });
  return is_row ? std::optional(row) : std::nullopt;
}

}  // namespace

std::optional<ContactPoint> fitted_contact(const ContactPoint& nearest,
                                           std::span<const ContactPoint* const> near,
                                           Scalar most_sagitta) {
  const std::optional<Row> row = find_row(nearest, near);
  if (!row) return std::nullopt;
  // gap(x) = gap + slope x + bend x^2
  const auto& [next, last, ahead, behind] = *row;
  const Scalar rise_ahead = (next->gap - nearest.gap) / ahead;
  const Scalar rise_behind = (last->gap - nearest.gap) / behind;
  const Scalar bend = (rise_ahead - rise_behind) / (ahead - behind);
  const Scalar slope = rise_ahead - bend * ahead;
  const Scalar facet = std::max(ahead, -behind);
  if (!(bend > 0) || !(bend * facet * facet / 4 <= most_sagitta)) return std::nullopt;
  const Scalar x = std::clamp(-slope / (2 * bend), behind, ahead);
  const Scalar part_next = x * (x - behind) / (ahead * (ahead - behind));
  const Scalar part_last = x * (x - ahead) / (behind * (behind - ahead));
  const auto blend = [&, next = next, last = last](Vector3 ContactPoint::*field) -> Vector3 {
    return (1 - part_next - part_last) * nearest.*field + part_next * next->*field +
           part_last * last->*field;
  };
  ContactPoint fitted = nearest;
  for (const auto field :
       {&ContactPoint::p_WCa, &ContactPoint::p_WCb, &ContactPoint::p_ACa, &ContactPoint::p_BCb}) {
    fitted.*field = blend(field);
  }
  fitted.nhat_AB_W = blend(&ContactPoint::nhat_AB_W).normalized();
  fitted.nhat_AB_S = blend(&ContactPoint::nhat_AB_S).normalized();
  fitted.gap = fitted.nhat_AB_W.dot(fitted.p_WCb - fitted.p_WCa);
  return fitted;
}

}  // namespace dyop::contact_internal
