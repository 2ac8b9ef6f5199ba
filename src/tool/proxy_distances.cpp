// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "tool/proxy.h"

namespace dyop::internal {
namespace {

// A distance is measured again when its bounds are farther apart than this fraction of the standoff
// and than the options allow.
constexpr Scalar kVagueShare = 0.25;

// It is then measured to this fraction of what is allowed, so that it lasts a while.
constexpr Scalar kMeasuredShare = 0.9;

}  // namespace

void Proxy::measure(PairState& pair, const DistanceWish& wish, WorkClock& clock,
                    TickStatistics& work) {
  ++work.distance_queries;
  const PairDistance found = obstacles_[pair.obstacle]->measure(
      bodies_[pair.body], body_pose(pair.body), wish, clock, pair.kept);
  const Scalar lower = std::max(pair.distance.lower, found.lower);
  if (!clock.cutoff() || found.upper < pair.distance.upper) pair.distance = found;
  pair.distance.lower = lower;
}

// The clearance is that of the nearest body: others only have to be proven farther away.
DistanceWish Proxy::wish_for(std::size_t obstacle, PairDistance& least) const {
  least.lower = kInfinity;
  for (const PairState& pair : pairs_) {
    if (pair.obstacle != obstacle) continue;
    least.lower = std::min(least.lower, pair.distance.lower);
    least.upper = std::min(least.upper, pair.distance.upper);
  }
  const Scalar margin = obstacles_[obstacle]->margin;
  const Scalar allowed =
      options_.clearance_tolerance * std::min(least.lower, std::abs(least.lower - margin)) +
      kVagueShare * options_.standoff;
  return {least.upper, allowed};
}

// Begins where the last tick was cut off.
void Proxy::measure(WorkClock& clock, TickStatistics& work) {
  for (std::size_t k = 0; k < obstacles_.size(); ++k) {
    const std::size_t number = (measured_first_ + k) % obstacles_.size();
    if (measure_obstacle(number, clock, work)) continue;
    measured_first_ = number;
    return;
  }
  measured_first_ = 0;
}

bool Proxy::measure_obstacle(std::size_t number, WorkClock& clock, TickStatistics& work) {
  PairDistance least;
  const Scalar allowed = wish_for(number, least).allowed;
  if (least.upper - least.lower <= allowed) return true;
  const Scalar tight = kMeasuredShare * allowed;
  const auto measure_if = [&](const auto& is_chosen) {
    for (PairState& pair : pairs_) {
      if (pair.obstacle != number || !is_chosen(pair) || clock.is_over()) continue;
      measure(pair, {least.upper, tight}, clock, work);
      least.upper = std::min(least.upper, pair.distance.upper);
    }
  };
  // The nearest first, so that little is left to do for the others.
  const Scalar nearest = least.upper;
  measure_if([&](const PairState& pair) { return !(pair.distance.upper > nearest); });
  measure_if([&](const PairState& pair) {
    return pair.distance.upper > least.upper && pair.distance.lower < least.upper - tight;
  });
  return !clock.cutoff();
}

}  // namespace dyop::internal
