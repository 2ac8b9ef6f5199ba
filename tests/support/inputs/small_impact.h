// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/toi/toi_result.h"

namespace dyop::testing {

/// An impact with all its data, without running a query.
inline ToiResult small_impact_result() {
  ToiResult toi;
  toi.status = ToiStatus::Impact;
  toi.t_safe = 1.0 / 3;
  toi.t_hit = 0.34;
  toi.rounding_allowance = 1e-15;
  toi.statistics = {11, 22, 33, 44};
  toi.X_WB = RigidPose(Vector3(0.1, 0.2, 0.7));
  ImpactContact contact;
  contact.lower = 0.1;
  contact.upper = 0.2;
  contact.p_WCa = Vector3(1.0 / 7, 2, 3);
  contact.nhat_AB_W = Vector3(0.6, 0.8, 0);
  contact.closing_speed = 2.5;
  contact.feature_a = {FeatureKind::Edge, {4, 5}};
  contact.feature_b = {};
  contact.triangle_a = 17;
  toi.contact = contact;
  return toi;
}

}  // namespace dyop::testing
