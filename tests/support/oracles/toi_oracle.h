// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "dyop/core/time_interval.h"
#include "dyop/motion/motion.h"
#include "support/oracles/fast_distance_oracle.h"

namespace dyop::testing {

/// lower <= min of the distance over an interval <= upper.
struct MinimumDistance {
  Scalar lower = 0;
  Scalar upper = kInfinity;
  Scalar t = 0;  ///< a time at which the distance is at most `upper`
  int samples = 0;
};

struct FirstApproach {
  /// With T(x) the first time of the interval at which the distance is at most x:
  ///     T(distance + resolution) <= t <= T(distance).
  /// Nothing: the distance is above `distance` on the whole interval.
  std::optional<Scalar> t;
  DistanceBracket at_t;  ///< distance at t
  int samples = 0;
};

/// Time of impact by sampling the distance, where each sample proves its neighbourhood by a
/// Lipschitz bound: the distance changes at most at the rate
///     L = |v_A| + |v_B| + |w_A| r_A + |w_B| r_B,
/// with speeds from Motion::twist_bound() over the interval in question, and radii r from the
/// vertices. This and Motion::pose() are all that the oracle takes from the library. Bounds of
/// distances hold up to the rounding stated at fast_oracle_distance() (1e-13 of the size).
///
/// Cost: one distance query a sample (about 1 ms for meshes of 70,000 triangles); at most about
/// (length of the interval) L / resolution samples where the distance stays near its minimum, some
/// dozens for a plain approach. Gives up with InternalError after a million.
///
/// Refers to its arguments. Not thread-safe: it remembers the last nearest pair.
class ToiOracle {
 public:
  ToiOracle(const OracleBody& a, const Motion& X_WA, const OracleBody& b, const Motion& X_WB);

  /// Bounds at one time that differ by at most `resolution` (and rounding). Detects containment.
  DistanceBracket distance_at(Scalar t, Scalar resolution = 0);

  /// The minimum over `interval` with upper - lower <= resolution (and rounding), resolution > 0.
  MinimumDistance min_distance_on(const TimeInterval& interval, Scalar resolution);

  /// When the distance first falls to `distance`, see FirstApproach; resolution > 0 is a length.
  /// To check a claim "at least d up to t_safe": ask for d - resolution on [begin, t_safe]. A time
  /// found refutes the claim (at_t.upper < d); none proves it up to the resolution. This is much
  /// cheaper than min_distance_on().
  FirstApproach first_time_within(Scalar distance, const TimeInterval& interval, Scalar resolution);

  /// L over `interval`.
  Scalar approach_speed_bound(const TimeInterval& interval) const;

 private:
  DistanceBracket surface_distance(Scalar t, const SearchGap& gap);
  bool contains_at(Scalar t) const;
  Scalar safe_step(Scalar t, Scalar end, Scalar slack) const;

  const OracleBody& a_;
  const OracleBody& b_;
  const Motion& X_WA_;
  const Motion& X_WB_;
  PairSeed seed_;
};

}  // namespace dyop::testing
