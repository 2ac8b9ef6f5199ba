// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/core/rigid_pose.h"

#include <cmath>

#include "core/tolerance.h"
#include "dyop/core/error.h"

namespace dyop {
namespace {

void require_finite(const Vector3& p) {
  DYOP_REQUIRE(p.allFinite(), "pose translation must be finite, not (", p.transpose(), ")");
}

}  // namespace

RigidPose::RigidPose(const Vector3& p_AB) : p_(p_AB) {
  require_finite(p_AB);
}

RigidPose::RigidPose(const Quaternion& q_AB, const Vector3& p_AB) : p_(p_AB) {
  require_finite(p_AB);
  const Scalar norm = q_AB.norm();
  DYOP_REQUIRE(std::abs(norm - 1) <= kRotationTolerance,
               "pose rotation must be a unit quaternion, but (w x y z) = (", q_AB.w(), " ",
               q_AB.x(), " ", q_AB.y(), " ", q_AB.z(), ") has norm ", norm);
  R_ = q_AB.normalized().toRotationMatrix();
}

RigidPose::RigidPose(const Matrix3& R_AB, const Vector3& p_AB) : p_(p_AB) {
  require_finite(p_AB);
  const Scalar deviation = (R_AB.transpose() * R_AB - Matrix3::Identity()).cwiseAbs().maxCoeff();
  DYOP_REQUIRE(deviation <= kRotationTolerance,
               "pose rotation must be orthonormal, but R^T R is off by ", deviation);
  DYOP_REQUIRE(R_AB.determinant() > 0, "pose rotation must not mirror: determinant ",
               R_AB.determinant());
  R_ = Quaternion(R_AB).normalized().toRotationMatrix();
}

Matrix3 rotation_from_vector(const Vector3& w) {
  const Scalar angle = w.norm();
  // sin(x/2)/x through the quaternion: no cancellation at small angles. literal: below it the
  // series 1/2 - x^2/48 is accurate to double precision.
  const Scalar half_sinc = angle > 1e-4 ? std::sin(angle / 2) / angle : 0.5 - angle * angle / 48;
  const Quaternion q(std::cos(angle / 2), w.x() * half_sinc, w.y() * half_sinc, w.z() * half_sinc);
  return q.normalized().toRotationMatrix();
}

// Eigen's needs a singular value decomposition, which takes seconds to compile: here once.
Quaternion rotation_between(const Vector3& from, const Vector3& to) {
  return Quaternion::FromTwoVectors(from, to);
}

Vector3 rotation_vector(const Matrix3& R) {
  Quaternion q(R);
  if (q.w() < 0) q.coeffs() *= -1;
  const Scalar sin_half = q.vec().norm();
  const Scalar angle = 2 * std::atan2(sin_half, q.w());
  // For tiny angles angle / sin_half tends to 2 and both are exact enough.
  return sin_half > 0 ? Vector3(q.vec() * (angle / sin_half)) : Vector3::Zero();
}

}  // namespace dyop
