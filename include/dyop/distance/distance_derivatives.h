// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <iosfwd>
#include <optional>
#include <string_view>

#include "dyop/core/rigid_pose.h"
#include "dyop/distance/distance_result.h"
#include "dyop/geometry/shape.h"
#include "dyop/motion/motion.h"

namespace DYOP_EXPORT dyop {

/// How a number changes with the pose of a body: six numbers, all in world.
struct PoseGradient {
  Vector3 translation = Vector3::Zero();  ///< per length that the origin moves
  Vector3 rotation = Vector3::Zero();     ///< per radian that the body turns about its origin

  /// The rate of change while the body moves.
  Scalar along(const Twist& twist) const {
    return translation.dot(twist.v_WB) + rotation.dot(twist.w_WB);
  }
};

/// How a vector changes with the pose of a body, likewise: (3 x 3), a column per axis of the world.
struct PoseJacobian {
  Matrix3 translation = Matrix3::Zero();
  Matrix3 rotation = Matrix3::Zero();

  Vector3 along(const Twist& twist) const {
    return translation * twist.v_WB + rotation * twist.w_WB;
  }
};

/// How the witness points and the normal of a distance change with both poses.
struct WitnessJacobians {
  PoseJacobian p_WCa_by_a;
  PoseJacobian p_WCa_by_b;
  PoseJacobian p_WCb_by_a;
  PoseJacobian p_WCb_by_b;
  PoseJacobian nhat_by_a;
  PoseJacobian nhat_by_b;
};

/// Whether derivatives may be used.
enum class DerivativeStatus {
  NotRun,
  Proven,    ///< every one-sided derivative is within the tolerance of the gradient
  Unproven,  ///< flagged: the error may be larger, though no corner was seen
  Tie,       ///< flagged: other pieces are as near, and the distance has a corner
  Touching,  ///< flagged: the shapes are not proven apart; there is no gradient
  Grazing,   ///< flagged: of a time of impact only; the shapes hardly approach each other there
};

/// The enumerator's name.
std::string_view name_of(DerivativeStatus status);
std::ostream& operator<<(std::ostream& out, DerivativeStatus status);

struct DerivativeOptions {
  /// Largest error that counts as Proven; relative, see DistanceDerivatives::error. > 0.
  /// Touching features need a coarser one than features far apart: what can be proven at a distance
  /// d of shapes of size r is about 1e-7 sqrt(r / d).
  Scalar tolerance = 1e-3;
};

/// Result of distance_derivatives().
struct DistanceDerivatives {
  DerivativeStatus status = DerivativeStatus::NotRun;
  PoseGradient by_a;  ///< of the distance, by the pose of A
  PoseGradient by_b;  ///< by the pose of B
  /// Proven: the one-sided derivatives of the distance along the axes, for translations of A and,
  /// divided by A's bounding radius, for turns about A's origin, differ from `by_a` by no more.
  /// Where the distance is differentiable, the gradient is exact up to rounding.
  Scalar error = kInfinity;
  /// Checked, not proven. Absent unless Proven, for the smooth cores of cylinders, cones and
  /// ellipsoids, where features are parallel, and at the border of a feature, where they jump.
  std::optional<WitnessJacobians> witness;
  DistanceResult distance;  ///< at the poses given
};

/// Returns the derivatives of the distance of two shapes, and of its witness points and normal, by
/// both poses, and a proof that the distance has no corner there.
///
/// The gradient is (-n, -r_a x n) for A and (n, r_b x n) for B, n the normal from A to B and r the
/// witness points from the bodies' origins. With one nearest pair it is the derivative; with
/// several it is one of many. Twelve more distances, with A moved a little either way along and
/// about each axis, bound the one-sided derivatives from both sides:
/// docs/algorithms/derivatives.md.
///
/// @throws InvalidArgument if the tolerance is not > 0.
/// Cost: 13 distances, 12 of them warm. Reads the shapes only; thread-safe.
DistanceDerivatives distance_derivatives(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                         const RigidPose& X_WB,
                                         const DerivativeOptions& options = {});

}  // namespace dyop
