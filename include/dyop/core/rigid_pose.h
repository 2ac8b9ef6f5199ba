// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/types.h"

namespace DYOP_EXPORT dyop {

/// The pose X_AB of a frame B in a frame A: `p_AP = X_AB * p_BP`.
///
/// Poses are valid by construction: the rotation is orthonormal up to rounding and all entries
/// are finite. Names follow the monogram notation: X_AC = X_AB * X_BC (docs/concepts.md).
class RigidPose {
 public:
  /// Identity.
  RigidPose() = default;

  /// Translation only.
  /// @throws InvalidArgument if a coordinate is not finite.
  explicit RigidPose(const Vector3& p_AB);

  /// @param q_AB Unit quaternion; normalised if its norm is within kRotationTolerance of one.
  /// @throws InvalidArgument if it is not, or a number is not finite; the message states the norm.
  RigidPose(const Quaternion& q_AB, const Vector3& p_AB);

  /// @param R_AB Rotation matrix; replaced by the nearest rotation if orthonormal to
  ///             kRotationTolerance with determinant +1.
  /// @throws InvalidArgument if it is not, or a number is not finite.
  RigidPose(const Matrix3& R_AB, const Vector3& p_AB);

  /// For inner loops that computed a rotation themselves: neither checked nor changed.
  static RigidPose from_trusted(const Matrix3& R_AB, const Vector3& p_AB) {
    RigidPose X;
    X.R_ = R_AB;
    X.p_ = p_AB;
    return X;
  }

  const Matrix3& rotation() const { return R_; }
  const Vector3& translation() const { return p_; }
  Quaternion quaternion() const { return Quaternion(R_); }

  RigidPose inverse() const { return from_trusted(R_.transpose(), -(R_.transpose() * p_)); }
  Vector3 operator*(const Vector3& p_BP) const { return R_ * p_BP + p_; }
  RigidPose operator*(const RigidPose& X_BC) const {
    return from_trusted(R_ * X_BC.R_, R_ * X_BC.p_ + p_);
  }

 private:
  Matrix3 R_ = Matrix3::Identity();
  Vector3 p_ = Vector3::Zero();
};

/// Rotation exp([w]) by the vector w: angle |w| about w/|w|, right-handed. Any finite w.
Matrix3 rotation_from_vector(const Vector3& w);

/// The shortest rotation that takes the direction `from` to the direction `to`; where they are
/// opposite, about some axis across them. Of any length but zero.
Quaternion rotation_between(const Vector3& from, const Vector3& to);

/// The rotation vector of R with norm in [0, pi].
Vector3 rotation_vector(const Matrix3& R);

}  // namespace dyop
