// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>

#include "dyop/motion/motion.h"

namespace dyop::motion_internal {

/// Shared by HermiteMotion and BezierMotion: position p_W0 + x(s) and rotation R_WC exp(theta(s)),
/// C a fixed frame, with polynomials x and theta of s, which runs from 0 to 1 over the domain.
///
/// Bounds over a part of the domain come from the Bernstein coefficients over that part: |w| <=
/// |theta'| and |w'| <= |theta''| + |theta'| min(|theta x theta'| / 6, |theta'| / pi). They
/// converge to the true suprema as the part shrinks, where theta = 0 or the axis is fixed. Cost of
/// a bound: O(degree^3), no allocation. See docs/algorithms/motions.md.
template <std::size_t kMaxDegree>
class ChartCurve {
 public:
  /// The first degree + 1 entries are the polynomial's Bernstein coefficients over the domain.
  using Coefficients = std::array<Vector3, kMaxDegree + 1>;

  /// `motion` names the motion in error messages; `displacement` holds the coefficients of x: small
  /// numbers, so that derivatives far from the world's origin are exact differences.
  /// @throws InvalidArgument if the interval has no length or is not finite, or accelerations
  ///         overflow.
  ChartCurve(const char* motion, const TimeInterval& interval, const RigidPose& X_WC,
             const Vector3& p_W0, std::size_t degree, const Coefficients& displacement,
             const Coefficients& theta);

  const TimeInterval& interval() const { return interval_; }
  RigidPose X_WC() const { return RigidPose::from_trusted(R_WC_, Vector3::Zero()); }

  MotionState state(Scalar t) const;
  /// That of state(t), to the bit, at half the cost.
  RigidPose pose(Scalar t) const;
  TwistBound twist_bound(const TimeInterval& interval) const;
  PoseScale pose_scale() const;

 private:
  // One polynomial with its derivatives in time.
  struct Polynomial {
    Coefficients value;         // degree_ + 1 of them
    Coefficients rate;          // degree_
    Coefficients acceleration;  // degree_ - 1
    Scalar value_noise;         // rounding in values, rates and accelerations on any part
    Scalar rate_noise;
    Scalar acceleration_noise;
  };

  Polynomial make_polynomial(const Coefficients& value) const;
  Scalar acceleration_bound(const Polynomial& polynomial, Scalar s0, Scalar s1) const;
  Scalar parameter(Scalar t) const { return (t - interval_.begin) / interval_.length(); }
  Scalar noise() const;

  TimeInterval interval_;
  Matrix3 R_WC_;
  Vector3 p_W0_;
  std::size_t degree_;
  Polynomial displacement_;
  Polynomial theta_;
};

extern template class ChartCurve<3>;
extern template class ChartCurve<9>;

}  // namespace dyop::motion_internal
