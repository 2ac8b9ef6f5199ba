// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/world_impl.h"
#include "dyop/toi/time_of_impact.h"

namespace dyop {

using dynamics_internal::BodyRecord;
using dynamics_internal::PairKey;

// Overlaps with sensors over a committed step. A body that only passes through within the step
// gives both events, begin and end.
void World::Impl::sense(const CommittedStep& step, AdvanceReport& report) {
  for (const auto& pair : pairs) {
    const PairKey key = pair->key;
    const BodyRecord& a = bodies[key.a];
    const BodyRecord& b = bodies[key.b];
    if (a.definition.is_sensor == b.definition.is_sensor) continue;
    const BodyId sensor = a.definition.is_sensor ? a.id : b.id;
    const BodyId body = a.definition.is_sensor ? b.id : a.id;
    const Scalar t = step.interval.end;
    const bool was = overlapping_sensors.contains(key);
    const bool is =
        distance(*a.definition.shape, a.X_WB(), *b.definition.shape, b.X_WB()).lower <= 0;
    if (was && !is) {
      overlapping_sensors.erase(key);
      report.sensors.push_back({sensor, body, t, false});
    }
    if (was || !step.motions[key.a] || !step.motions[key.b]) continue;
    ToiOptions query;
    query.distance_tolerance = pair->lengths.tolerance();
    query.max_node_pairs = options.max_node_pairs;
    const ToiResult met =
        time_of_impact(*a.definition.shape, *step.motions[key.a], *b.definition.shape,
                       *step.motions[key.b], step.interval, query);
    if (met.status == ToiStatus::Separated && !is) continue;
    report.sensors.push_back({sensor, body, met.t_safe, true});
    if (is) {
      overlapping_sensors.insert(key);
    } else {
      report.sensors.push_back({sensor, body, t, false});
    }
  }
}

}  // namespace dyop
