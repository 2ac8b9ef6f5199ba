// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "haptics/proxy.h"

namespace dyop::haptics_internal {
namespace {

// A distance is measured again when its bounds are farther apart than this fraction of the rest
// offset and than the options allow.
constexpr Scalar kVagueShare = 0.25;

// It is then measured to this fraction of what is allowed, so that it lasts a while.
constexpr Scalar kMeasuredShare = 0.9;

}  // namespace

// Both bounds hold, whatever was found.
void Proxy::take(const PairDistance& found, ProxyPair& pair) {
  const Scalar lower = std::max(pair.distance.lower, found.lower);
  if (found.upper < pair.distance.upper) pair.distance = found;
  pair.distance.lower = lower;
}

void Proxy::measure(ProxyPair& pair, const DistanceWish& wish, WorkShare& share,
                    TickStatistics& work) {
  ++work.distance_queries;
  take(obstacles_[pair.obstacle]->measure(bodies_[pair.body], body_pose(pair.body), wish, share,
                                          pair.kept),
       pair);
}

// The clearance is that of the nearest body: others only have to be proven farther away. Relative
// to the lower bound the upper one may exceed it by the tolerance.
DistanceWish Proxy::wish_for(std::size_t obstacle) const {
  Scalar upper = kInfinity;
  for (std::size_t k = obstacle; k < pairs_.size(); k += obstacles_.size()) {
    upper = std::min(upper, pairs_[k].distance.upper);
  }
  const Scalar free = std::min(upper, std::abs(upper - obstacles_[obstacle]->margin));
  const Scalar tolerance = options_.clearance_tolerance;
  const Scalar allowed = (upper < kInfinity ? tolerance / (1 + tolerance) * free : 0) +
                         kVagueShare * options_.rest_offset;
  return {upper, allowed, kMeasuredShare * allowed};
}

// How many times farther than allowed the pair's lower bound is below the clearance's upper one.
Scalar Proxy::excess(const ProxyPair& pair, const DistanceWish& wish) const {
  return (wish.farthest - pair.distance.lower) / wish.allowed;
}

// The pairs first whose bounds are the worst for what is allowed; those that are left when the
// share is used up are the worst in the next tick.
void Proxy::measure(WorkShare share, TickStatistics& work) {
  if (share.clock.cutoff()) return;
  loose_.clear();
  for (std::size_t obstacle = 0; obstacle < obstacles_.size(); ++obstacle) {
    refresh(obstacle);
    const DistanceWish wish = wish_for(obstacle);
    for (std::size_t k = obstacle; k < pairs_.size(); k += obstacles_.size()) {
      const Scalar times = excess(pairs_[k], wish);
      if (times > 1) loose_.push_back({times, k});
    }
  }
  std::sort(loose_.begin(), loose_.end(), [](const Loose& x, const Loose& y) {
    return x.excess != y.excess ? x.excess > y.excess : x.pair < y.pair;
  });
  for (const Loose& loose : loose_) {
    if (share.is_over()) return;
    ProxyPair& pair = pairs_[loose.pair];
    const DistanceWish wish = wish_for(pair.obstacle);
    if (excess(pair, wish) > 1) measure(pair, wish, share, work);
  }
}

// Re-measure the last nearest points first; often that tightens the bounds enough.
void Proxy::refresh(std::size_t obstacle) {
  const DistanceWish wish = wish_for(obstacle);
  for (std::size_t k = obstacle; k < pairs_.size(); k += obstacles_.size()) {
    ProxyPair& pair = pairs_[k];
    if (!(pair.distance.upper <= wish.farthest) || !(excess(pair, wish) > 1)) continue;
    take(obstacles_[obstacle]->measure_again(bodies_[pair.body], body_pose(pair.body), pair.kept),
         pair);
  }
}

}  // namespace dyop::haptics_internal
