// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "dyop/core/types.h"

namespace dyop::contact_internal {

using Vector6 = Eigen::Matrix<Scalar, 6, 1>;
using Rows6 = Eigen::Matrix<Scalar, 3, 6, Eigen::RowMajor>;

enum class BlockKind {
  Contact,  // impulse (normal, two tangents) in Coulomb's cone
  Row,      // of a joint: lower <= impulse <= upper
  Rolling,  // two components, bounded by the normal impulse of the contact `owner`
  Torsion,  // one component, bounded likewise
};

// The mobility W of one contact, prepared for solving its laws by themselves many times.
class LocalContact {
 public:
  LocalContact() = default;
  explicit LocalContact(const Matrix3& W);

  // Finds lambda (normal, two tangents) such that u = W lambda + q and lambda obey Signorini's and
  // Coulomb's laws. Exact up to rounding for every positive definite W. If there are several
  // solutions (large friction), returns one that separates or sticks if it exists.
  //
  // Sliding means lambda_t = -u_t / slip: with u_n = 0 eliminated, (A + slip) lambda_t = b, and
  // slip is the root of friction lambda_n / |lambda_t| = 1. `slip` is the initial guess and returns
  // the result (0: sticks or separates), unless there is a closed form, which leaves it alone.
  Vector3 solve(const Vector3& q, Scalar friction, Scalar& slip) const;

  // Whether normal and tangents act one by one and the tangents alike.
  bool is_uncoupled() const { return is_uncoupled_; }
  Scalar normal_inverse() const { return normal_inverse_; }
  Scalar tangential() const { return tangential_; }

 private:
  Vector3 solve_uncoupled(const Vector3& q, Scalar friction) const;
  Vector3 solve_coupled(const Vector3& q, Scalar friction, Scalar& slip) const;

  bool is_uncoupled_ = false;
  Scalar normal_inverse_ = 0;
  Scalar tangential_ = 0;          // mobility along both tangents, if uncoupled
  Scalar tangential_inverse_ = 0;  // the same
  Vector2 coupling_ = Vector2::Zero();
  Eigen::Matrix2d A_ = Eigen::Matrix2d::Zero();  // of the tangents with u_n = 0 eliminated
  Eigen::Matrix2d A_inverse_ = Eigen::Matrix2d::Zero();
};

// What a further body has to do with a contact.
struct Carried {
  int slot = -1;
  Rows6 G = Rows6::Zero();
};

// What one contact or row requires of the bodies, in coordinates in which every body has unit mass:
// body velocity = free velocity + S y with S S^T the mobility, relative velocity minus target u =
// free + G_a y_a + G_b y_b, and y = sum of G^T lambda; carriers add their G y. Rows that a kind
// does not have are zero. Tangents of an ellipse are scaled so that its cone is round; rolling and
// torsional rows are scaled by their coefficient (a length), which makes it one and u a length per
// time.
struct Block {
  BlockKind kind = BlockKind::Contact;
  int slot_a = -1;  // index into y; negative: immovable
  int slot_b = -1;
  int owner = -1;  // the contact block whose normal impulse bounds this one
  int carriers = 0;
  const Carried* carried = nullptr;  // so many, of the system
  Rows6 G_a = Rows6::Zero();
  Rows6 G_b = Rows6::Zero();
  Vector3 free = Vector3::Zero();
  Matrix3 W = Matrix3::Zero();  // sum of G G^T
  Scalar weight = 0;            // trace of W with compliance
  Scalar friction = 0;
  Scalar lower = 0;
  Scalar upper = 0;
  Scalar compliance = 0;
  Vector3 lambda = Vector3::Zero();
  Scalar slip = 0;     // of the last local solution, see LocalContact; starts the next one
  LocalContact local;  // of W, for a contact
};

// The laws of LocalContact for two components that are bounded by |lambda| <= radius and oppose
// u = W lambda + q.
Vector2 solve_disc(const Eigen::Matrix2d& W, const Vector2& q, Scalar radius, Scalar& slip);

// Length of the tangential part. Loads one number at a time: processors wait for a pair that was
// stored as parts of two others, as happens when a vector of three has just been computed.
inline Scalar tangent_length(const Vector3& x) {
  const Scalar a = x[1];
  const Scalar b = x[2];
  return std::sqrt(a * a + b * b);
}

// Inline, for contacts where nothing is coupled: sweeps over crowds of balls spend their time here.
inline Vector3 LocalContact::solve_uncoupled(const Vector3& q, Scalar friction) const {
  const Scalar normal = -q[0] * normal_inverse_;
  const Scalar bound = friction * normal;
  const Scalar sliding = tangent_length(q);
  const Scalar shrink = sliding <= tangential_ * bound ? tangential_inverse_ : bound / sliding;
  return {normal, -q[1] * shrink, -q[2] * shrink};
}

inline Vector3 LocalContact::solve(const Vector3& q, Scalar friction, Scalar& slip) const {
  if (q[0] >= 0) {
    slip = 0;
    return Vector3::Zero();
  }
  return is_uncoupled_ ? solve_uncoupled(q, friction) : solve_coupled(q, friction, slip);
}

// Nearest point of {(n, t): |t| <= friction n}. Inline, as is project(): solvers spend most of
// their time here.
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
