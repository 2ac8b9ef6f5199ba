// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/core/export.h"
#include "dyop/core/types.h"
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

// Angular velocity and acceleration of R(t) = R_WC exp(theta(t)): proofs in
// docs/algorithms/motions.md.
//
// Rounding of bounds. The exact function of a motion is defined by its stored numbers, and a bound
// must exceed its exact suprema. With M the largest norm of a stored coefficient of a cubic:
// - one step (1 - s) x + s y errs by 3u M; two steps for the rate, three for theta;
// - the parameter s errs by 4u, times a derivative of at most 2 (degree) M in s: 16u M and 24u M;
// - the stored rate coefficients are differences of two stored numbers, relative error 3u;
// - together at most 40u M for rates and 45u M for theta; theta x theta' adds the two, 4u for a
//   cross product and 6u for the weighted sum: 95u times the product of the two M;
// - second derivatives are differences of rates: 75u M / h, M the largest rate.
// kMotionNoise = 128u is added relative to these M, and once more relative to the result, for norms
// and the stretch by a base rotation orthonormal to 8u. For degree n all are below n(n - 1)/6 times
// the allowance for cubics.

// Left Jacobian of SO(3) at theta, applied to theta_rate: the angular velocity in frame C.
//   w = theta' + (1 - cos f)/f^2 theta x theta' + (f - sin f)/f^3 theta x (theta x theta'),
// f = |theta|. Any finite arguments; error a few u |theta'|.
DYOP_EXPORT Vector3 angular_velocity(const Vector3& theta, const Vector3& theta_rate);

// exp([theta]) and the angular velocity of exp([theta(t)]) in frame C, sharing one sine and cosine.
struct TurningState {
  Matrix3 R;
  Vector3 w;
};
TurningState turning_state(const Vector3& theta, const Vector3& theta_rate);

// Its R alone, to the bit.
Matrix3 turning_rotation(const Vector3& theta);

// The theta' whose angular velocity in frame C is w. For |theta| <= pi, where the Jacobian's
// condition number is at most pi/2.
DYOP_EXPORT Vector3 rotation_vector_rate(const Vector3& theta, const Vector3& w_C);

// Rounds the computed bound x up by the relative error that a bound may have. NaN becomes infinity.
inline Scalar round_up(Scalar x) {
  return x >= 0 ? x * (1 + kMotionNoise) : kInfinity;
}

// The norm, without underflow of squares, which would make it too small.
inline Scalar norm_of(const Vector3& x) {
  const Scalar norm_sq = x.squaredNorm();
  // literal: the squares of the larger parts are normal numbers.
  return norm_sq > 0x1p-900 ? std::sqrt(norm_sq) : x.stableNorm();
}

// Bound on |w'| from bounds on |theta'|, |theta''| and |theta x theta'| over the same times:
//   |w'| <= |theta''| + |theta'| min(|theta x theta'| / 6, |theta'| / pi) .
Scalar angular_acceleration_bound(Scalar theta_rate, Scalar theta_acceleration, Scalar theta_turn);

// x y, and zero if either is zero, however large the other: 0 * infinity is not NaN.
inline Scalar times(Scalar x, Scalar y) {
  return x == 0 || y == 0 ? 0 : x * y;
}

// The longest time from t0 to a time of the interval.
inline Scalar longest_time(Scalar t0, const TimeInterval& interval) {
  return std::max(std::abs(interval.begin - t0), std::abs(interval.end - t0));
}

// Scale that covers two pieces of a motion.
inline PoseScale larger_of(const PoseScale& x, const PoseScale& y) {
  return {std::max(x.length, y.length), std::max(x.angle, y.angle)};
}

inline void require_finite(const Vector3& x, const char* what) {
  DYOP_REQUIRE(x.allFinite(), what, " must be finite, not (", x.transpose(), ")");
}

}  // namespace dyop::motion_internal
