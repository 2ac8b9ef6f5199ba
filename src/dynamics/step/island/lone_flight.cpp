// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/island/lone_flight.h"

#include "dynamics/step/island_run.h"

namespace dyop::dynamics_internal {
namespace {

void add_difference(IntegratorStatistics& sum, const IntegratorStatistics& before,
                    const IntegratorStatistics& after) {
  sum.steps += after.steps - before.steps;
  sum.rejected_steps += after.rejected_steps - before.rejected_steps;
  sum.function_evaluations += after.function_evaluations - before.function_evaluations;
}

}  // namespace

std::shared_ptr<const Motion> fly(const StepContext& context, const BodyRecord& body,
                                  const CentralState& state, const TimeInterval& interval,
                                  std::shared_ptr<FreeFlight>& flight, IntegratorStatistics& sum) {
  if (!flight) {
    flight =
        std::make_shared<FreeFlight>(body, state, context.gravity_W, context.options->integrator,
                                     context.options->integrator_options, interval.begin);
  }
  const IntegratorStatistics before = flight->statistics();
  std::shared_ptr<const Motion> motion = flight->motion(interval.begin, interval.end);
  add_difference(sum, before, flight->statistics());
  return motion;
}

Scalar known_way(const BodyRecord& body, const FreeFlight& flight, const TimeInterval& interval) {
  const std::optional<TwistBound> bound = flight.known_bound(interval);
  if (!bound) return kInfinity;
  return interval.length() * (bound->linear_speed + bound->angular_speed * body.radius_B);
}

bool is_alone(const StepContext& context, const Island& island) {
  return island.bodies.size() == 1 && island.pairs.empty() && island.joints.empty() &&
         island.springs.empty() && !context.body(island.bodies.front()).definition.locked.any();
}

void fly_alone(const StepContext& context, const Island& island, IslandOutcome& outcome) {
  const BodyRecord& body = context.body(island.bodies.front());
  const TimeInterval interval{context.t, context.t_end};
  outcome.restart();
  outcome.tracks.resize(1);
  Track& track = outcome.tracks.front();
  track.flight = body.flight;
  track.pieces.clear();
  const PartTimer timing(context.options->measures_time, outcome.times.flight);
  track.pieces.push_back(
      {interval, fly(context, body, body.state, interval, track.flight, outcome.integrator)});
  track.end = track.flight->state(interval.end);
  track.most_way = known_way(body, *track.flight, interval);
  outcome.work.substeps = 1;
  outcome.reached = interval.end;
  outcome.has_run = true;
}

}  // namespace dyop::dynamics_internal
