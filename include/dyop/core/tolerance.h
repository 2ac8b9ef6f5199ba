#pragma once

#include "dyop/core/types.h"

/// Every numerical constant of dyop. Three words, never mixed:
/// *noise* is rounding and is computed, *tolerance* is what the user asked for, *limit* is a count.
namespace dyop {

/// Unit roundoff u of double, 2^-53. All noise constants are multiples of it.
inline constexpr Scalar kUnitRoundoff = std::numeric_limits<Scalar>::epsilon() / 2;

/// How far a quaternion's norm or R^T R may be from one before a pose is refused (relative).
/// Below it the rotation is normalised. Larger: bad input passes; smaller: poses read from text
/// with seven digits are refused. Used by RigidPose.
inline constexpr Scalar kRotationTolerance = 1e-6;

/// Rounding allowance for one coordinate of a point carried through a pose, as a multiple of the
/// size of the numbers involved (|translation| + |point|). A matrix-vector product and a sum err
/// by at most gamma_4 per coordinate, sqrt(3) gamma_4 < 8u in norm ([Higham2002] ch. 3); composing
/// two poses first triples it, and a rotation matrix that is orthonormal to rounding only adds as
/// much again. Used by everything that compares points of two bodies. Smaller: bounds may fail.
inline constexpr Scalar kPoseNoise = 64 * kUnitRoundoff;

/// Time of impact: the distance that is never undercut lies this fraction of the user's distance
/// tolerance above the target. Larger: earlier reports; smaller: slower convergence at contact.
inline constexpr Scalar kFloorFraction = 0.25;

/// Largest coordinate of a vertex, length. Products of four lengths must not overflow: 1e60^4 =
/// 1e240 leaves room. Used by TriangleMesh and the convex shapes.
inline constexpr Scalar kLargestCoordinate = 1e60;

}  // namespace dyop
