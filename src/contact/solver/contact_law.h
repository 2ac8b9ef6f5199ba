// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact/solver/contact_block.h"

namespace dyop::internal {

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

// Nearest point of {(n, t): |t| <= friction n}.
Vector3 project_onto_cone(const Vector3& x, Scalar friction);

// Nearest point of a block's admissible impulses. `normal` is the owner's normal impulse.
Vector3 project(const Block& block, const Vector3& x, Scalar normal);

// A generalised derivative of project() at x: symmetric, eigenvalues in [0, 1].
Matrix3 project_derivative(const Block& block, const Vector3& x, Scalar normal);

}  // namespace dyop::internal
