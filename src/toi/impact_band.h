// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "core/tolerance.h"
#include "dyop/core/types.h"

namespace dyop::toi_internal {

/// The distances at which a search acts, in the band of width ε = distance_tolerance above the
/// target δ:
///
///     δ + ε      largest_impact  +------------------  farther apart: never an impact
///                                |  watched: steps are short from here on
///     δ + 3/4 ε  box_target      +------------------  boxes are opened before they come nearer
///     δ + 5/8 ε  contact         +------------------  nearer, closing, nearest of all: Impact
///     δ + ε/2    leaf_target     +------------------  steps of leaves aim here
///                                |  slack: for rounding, and for what slides or leaves
///     δ + ε/4    guaranteed      +------------------  proven on [begin, t_safe]
///                                |  a start here: InitiallyWithinTarget
///     δ          target          +------------------
///
/// Boxes aim above `contact`, so that every pair in contact has been measured before a pair is
/// reported. Leaves aim below it, so that one that closes in is reported after a few steps.
struct ImpactBand {
  Scalar tolerance = 0;  // ε itself
  Scalar guaranteed = 0;
  Scalar leaf_target = 0;
  Scalar contact = 0;
  Scalar box_target = 0;
  Scalar largest_impact = 0;

  ImpactBand(Scalar target_distance, Scalar distance_tolerance)
      : tolerance(distance_tolerance),
        guaranteed(target_distance + kGuaranteedFraction * distance_tolerance),
        leaf_target(target_distance + kLeafTargetFraction * distance_tolerance),
        contact(target_distance + kContactFraction * distance_tolerance),
        box_target(target_distance + kBoxTargetFraction * distance_tolerance),
        largest_impact(target_distance + distance_tolerance) {}

  /// How near a pair that rests in the band, at least `lower` apart, may come before it is measured
  /// again: it may lose an eighth of its slack. So a pair that slides or hops keeps most of its
  /// gap, and always has some slack.
  Scalar resting_target(Scalar lower, Scalar noise) const {
    const Scalar slack = std::max(2 * noise, (lower - guaranteed) / 8);
    return std::max(guaranteed, lower - slack);
  }
};

}  // namespace dyop::toi_internal
