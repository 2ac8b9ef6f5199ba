// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/export.h"
#include "dyop/toi/time_of_impact.h"
#include "toi/impact_band.h"

namespace dyop::toi_internal {

/// The arguments of time_of_impact() for two rigid shapes.
struct RigidQuery {
  const Shape& a;
  const Motion& X_WA;
  const Shape& b;
  const Motion& X_WB;
  const TimeInterval& interval;
  const ToiOptions& options;
  const ImpactBand& band;
};

/// Two balls, or a ball and a half-space.
DYOP_EXPORT bool are_balls_or_plane(const Shape& a, const Shape& b);

/// Answers a query of such shapes in closed form if the balls' centres, and the plane, move along
/// straight lines at constant speed: the times at which the gap falls to a given length are then
/// roots of a quadratic. Balls may turn about their centres in any way.
/// docs/algorithms/time_of_impact.md, "Balls on straight lines".
///
/// The result keeps the promises of the search, with a narrower [t_safe, t_hit]. Returns false, with
/// `result` unchanged, for other motions and for what is left to the search: contact at the start, a
/// grazing pass, a list of contacts, a deadline, a stop.
DYOP_EXPORT bool straight_impact(const RigidQuery& query, ToiResult& result);

}  // namespace dyop::toi_internal
