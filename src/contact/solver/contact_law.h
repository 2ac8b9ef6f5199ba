// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "contact/solver/contact_block.h"

namespace dyop::contact_internal {

// Solves one contact by itself: finds lambda (normal, two tangents) such that u = W lambda + q and
// lambda obey Signorini's and Coulomb's laws. Exact up to rounding for every positive definite W.
// If there are several solutions (large friction), returns one that separates or sticks if it
// exists.
//
// Sliding means lambda_t = -u_t / slip: with u_n = 0 eliminated, (A + slip) lambda_t = b, and slip
// is the root of friction lambda_n / |lambda_t| = 1. `slip` is the initial guess and returns the
// result (0: sticks or separates).
Vector3 solve_contact(const Matrix3& W, const Vector3& q, Scalar friction, Scalar& slip);

// The same for two components that are bounded by |lambda| <= radius and oppose u = W lambda + q.
Vector2 solve_disc(const Eigen::Matrix2d& W, const Vector2& q, Scalar radius, Scalar& slip);

// Length of the tangential part. Loads one number at a time: processors wait for a pair that was
// stored as parts of two others, as happens when a vector of three has just been computed.
inline Scalar tangent_length(const Vector3& x) {
  const Scalar a = x[1];
  const Scalar b = x[2];
  return std::sqrt(a * a + b * b);
}

// Nearest point of {(n, t): |t| <= friction n}. Inline, as is project(): solvers spend most of their
// time here.
inline Vector3 project_onto_cone(const Vector3& x, Scalar friction) {
  const Scalar t = tangent_length(x);
  if (x[0] >= 0 && t <= friction * x[0]) return x;
  if (friction * t <= -x[0]) return Vector3::Zero();
  const Scalar n = (x[0] + friction * t) / (1 + friction * friction);
  const Scalar shrink = friction * n / t;
  return {n, x[1] * shrink, x[2] * shrink};
}

// project() of a block that is not a contact.
Vector3 project_onto_bounds(const Block& block, const Vector3& x, Scalar normal);

// Nearest point of a block's admissible impulses. `normal` is the owner's normal impulse.
inline Vector3 project(const Block& block, const Vector3& x, Scalar normal) {
  return block.kind == BlockKind::Contact ? project_onto_cone(x, block.friction)
                                          : project_onto_bounds(block, x, normal);
}

// A generalised derivative of project() at x: symmetric, eigenvalues in [0, 1].
Matrix3 project_derivative(const Block& block, const Vector3& x, Scalar normal);

}  // namespace dyop::contact_internal
