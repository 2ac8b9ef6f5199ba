// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/distance/distance_derivatives.h"
#include "dyop/toi/toi_result.h"

namespace DYOP_EXPORT dyop {

struct ImpactDerivativeOptions {
  /// Largest error that counts as Proven, relative to the largest change that a shift of A by a
  /// unit length could make; > 0. The smaller the gap at the impact, the less can be proven.
  Scalar tolerance = 1e-2;
  /// Grazing: the gap closes at less than this fraction of the speed at which points of the two
  /// bodies can approach each other; in [0, 1).
  Scalar grazing_fraction = 1e-3;
};

/// Result of impact_derivatives().
struct ImpactDerivatives {
  DerivativeStatus status = DerivativeStatus::NotRun;
  /// Gradient of the time of impact by the pose of A (B) at that time: time per length and per
  /// radian. If a parameter of the motion changes that pose by the twist x, the time changes by
  /// by_a.along(x); see ConstantTwistMotion::pose_change().
  PoseGradient by_a;
  PoseGradient by_b;
  Scalar closing_speed = 0;  ///< of the gap: by_a and by_b are gradients of the gap over it
  /// Proven: bound on the error of the gradients by the poses of A, relative to closing_speed.
  Scalar error = kInfinity;
  DistanceDerivatives distance;  ///< at the impact
};

/// Returns the derivatives of a time of impact: dt = -dd / (dd/dt), with the derivatives of the
/// distance d at ToiResult::t_safe. So they are those of the time at which the gap falls to what it
/// is there; within the tolerance of the query that is the impact. Flagged where features tie,
/// where nothing is left of the gap, and where the bodies graze each other, so that nobody
/// differentiates a corner by mistake. Method: docs/algorithms/derivatives.md.
///
/// @param a, X_WA, b, X_WB As in the query.
/// @param impact Its result.
/// @throws InvalidArgument unless the status is Impact and the options are in range.
ImpactDerivatives impact_derivatives(const Shape& a, const Motion& X_WA, const Shape& b,
                                     const Motion& X_WB, const ToiResult& impact,
                                     const ImpactDerivativeOptions& options = {});

}  // namespace dyop
