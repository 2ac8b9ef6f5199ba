// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "dynamics/free_flight.h"
#include "dynamics/step/island/island.h"

namespace dyop::dynamics_internal {

struct StepContext;

/// The motion over an interval of a body that begins it at `state`; continues its flight, or starts
/// one. Adds the work of the integrator.
std::shared_ptr<const Motion> fly(const StepContext& context, const BodyRecord& body,
                                  const CentralState& state, const TimeInterval& interval,
                                  std::shared_ptr<FreeFlight>& flight, IntegratorStatistics& sum);

/// A bound on the way of any point of a body in a flight over an interval, if one is known already
/// for at least that time; infinite if not.
Scalar known_way(const BodyRecord& body, const FreeFlight& flight, const TimeInterval& interval);

/// Whether an island is one body that nothing can stop or hold: free flight is all it needs.
bool is_alone(const StepContext& context, const Island& island);

/// What IslandRun does for such an island, without looking for what is not there.
void fly_alone(const StepContext& context, const Island& island, IslandOutcome& outcome);

}  // namespace dyop::dynamics_internal
