#pragma once

#include "dyop/distance/distance.h"
#include "dyop/toi/toi_result.h"

namespace dyop::internal {

/// The impact engine's contact in the form of find_contacts().
inline Contact contact_of(const ImpactContact& impact) {
  Contact contact;
  contact.p_WCa = impact.p_WCa;
  contact.p_WCb = impact.p_WCb;
  contact.nhat_AB_W = impact.nhat_AB_W;
  contact.lower = impact.distance_lower;
  contact.upper = impact.distance_upper;
  contact.feature_a = impact.feature_a;
  contact.feature_b = impact.feature_b;
  contact.triangle_a = impact.triangle_a;
  contact.triangle_b = impact.triangle_b;
  return contact;
}

}  // namespace dyop::internal
