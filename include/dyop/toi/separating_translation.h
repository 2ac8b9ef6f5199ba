// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "dyop/core/rigid_pose.h"
#include "dyop/distance/distance_result.h"
#include "dyop/geometry/shape.h"

namespace DYOP_EXPORT dyop {

struct SeparationOptions {
  /// Directions spread over the sphere that are tried first, in [1, 10000]. Twice as many take
  /// twice as long and find a shorter way where shapes are intricate.
  int directions = 48;
  /// How much longer the translation may be than the shortest one along its direction; length, > 0.
  /// Default: default_distance_tolerance().
  std::optional<Scalar> tolerance = {};
};

/// Returns how far and along which direction B can be moved so that two overlapping shapes of any
/// kind come apart, or nothing if they do not overlap, or if rounding allows no proof.
///
/// Proven: B, moved by `depth` along `nhat_AB_W`, is apart from A. So the depth is an upper bound
/// on the least translation that separates them; it is the shortest way out along its own
/// direction, from outside, up to the tolerance, and a local minimum over directions in practice.
/// Closed meshes are solids. A half-space is left along its normal, by the least depth; two of them
/// give nothing. For two convex shapes find_penetration() is faster.
///
/// @throws InvalidArgument if an option is out of range.
/// Cost: some two hundred times of impact of a translation. Method: docs/algorithms/distance.md.
std::optional<Penetration> separating_translation(const Shape& a, const RigidPose& X_WA,
                                                  const Shape& b, const RigidPose& X_WB,
                                                  const SeparationOptions& options = {});

}  // namespace dyop
