// SPDX-License-Identifier: BSD-3-Clause
#include "contact/solver/contact_law.h"

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"

namespace dyop::contact_internal {
namespace {

// (A + slip)^-1 x for a symmetric 2x2 matrix.
class ShiftedInverse {
 public:
  ShiftedInverse(const Eigen::Matrix2d& A, Scalar slip)
      : a_(A(0, 0) + slip), b_(A(0, 1)), d_(A(1, 1) + slip), factor_(1 / (a_ * d_ - b_ * b_)) {}

  Vector2 operator*(const Vector2& x) const {
    return {(d_ * x[0] - b_ * x[1]) * factor_, (a_ * x[1] - b_ * x[0]) * factor_};
  }

 private:
  Scalar a_, b_, d_, factor_;
};

// The tangential impulse p = (A + slip)^-1 b at which the bound c0 + c . p equals |p|, for c0 > 0
// and a bound below |p| at slip = 0. The function (c0 + c . p) / |p| - 1 of slip is nearly linear,
// and exactly so for isotropic A; solved by Newton's method within a bracket.
Vector2 slide(const Eigen::Matrix2d& A, const Vector2& b, Scalar c0, const Vector2& c,
              Scalar& slip) {
  Scalar low = 0;
  Scalar high = kInfinity;
  Scalar x = slip > 0 ? slip : 0;
  Vector2 p = Vector2::Zero();
  for (int i = 0; i < kContactSlideLimit; ++i) {
    const ShiftedInverse inverse(A, x);
    p = inverse * b;
    const Scalar length = p.norm();
    const Scalar bound = c0 + c.dot(p);
    const Scalar excess = bound - length;
    if (std::abs(excess) <= kContactSlideNoise * length) break;
    (excess < 0 ? low : high) = x;
    const Vector2 dp = -(inverse * p);
    const Scalar slope = c.dot(dp) - bound * p.dot(dp) / (length * length);
    Scalar next = x - excess / slope;
    if (!(next > low && next < high)) {  // also NaN
      next = high < kInfinity ? (low + high) / 2 : 2 * x + A.trace();
    }
    if (next == x) break;
    x = next;
  }
  slip = x;
  return p;
}

// Shortens p to the bound, so that rounding cannot leave the cone.
Vector2 clip(const Vector2& p, Scalar bound) {
  const Scalar length = p.norm();
  return length > bound ? Vector2(p * (std::max(bound, Scalar{0}) / length)) : p;
}

// Whether the normal and the tangents act on velocities one by one and the tangents alike, as where
// the line of a contact goes through both centres of mass: spheres.
bool has_no_coupling(const Matrix3& W) {
  const Scalar noise = kContactMobilityNoise * W.trace();
  const Scalar largest = std::max(
      {std::abs(W(1, 0)), std::abs(W(2, 0)), std::abs(W(2, 1)), std::abs(W(1, 1) - W(2, 2))});
  return largest <= noise;
}

}  // namespace

LocalContact::LocalContact(const Matrix3& W) : normal_inverse_(1 / W(0, 0)) {
  const Scalar noise = kContactMobilityNoise * W.trace();  // handles a locked direction
  is_uncoupled_ = has_no_coupling(W);
  tangential_ = W(1, 1) + noise;
  tangential_inverse_ = 1 / tangential_;
  coupling_ = W.block<2, 1>(1, 0) * normal_inverse_;
  A_ = W.bottomRightCorner<2, 2>() - coupling_ * W.block<1, 2>(0, 1);
  A_.diagonal().array() += noise;
  const ShiftedInverse inverse(A_, 0);
  A_inverse_ << inverse * Vector2::UnitX(), inverse * Vector2::UnitY();
}

Vector3 LocalContact::solve_coupled(const Vector3& q, Scalar friction, Scalar& slip) const {
  const Scalar normal = -q[0] * normal_inverse_;
  if (friction == 0) return {normal, 0, 0};
  const Vector2 b = coupling_ * q[0] - q.tail<2>();
  Vector2 p = A_inverse_ * b;
  Scalar n = normal - coupling_.dot(p);
  if (p.squaredNorm() <= friction * friction * n * n && n >= 0) {
    slip = 0;
  } else {
    p = slide(A_, b, friction * normal, -friction * coupling_, slip);
    n = std::max(normal - coupling_.dot(p), Scalar{0});
    p = clip(p, friction * n);
  }
  return {n, p[0], p[1]};
}

Vector2 solve_disc(const Eigen::Matrix2d& W, const Vector2& q, Scalar radius, Scalar& slip) {
  if (!(radius > 0)) return Vector2::Zero();
  Eigen::Matrix2d A = W;
  A.diagonal().array() += kContactMobilityNoise * W.trace();
  const Vector2 p = ShiftedInverse(A, 0) * -q;
  if (p.squaredNorm() <= radius * radius) {
    slip = 0;
    return p;
  }
  return clip(slide(A, -q, radius, Vector2::Zero(), slip), radius);
}

namespace {

Matrix3 cone_derivative(const Vector3& x, Scalar friction) {
  const Scalar t = tangent_length(x);
  if (x[0] >= 0 && t <= friction * x[0]) return Matrix3::Identity();
  if (friction * t <= -x[0]) return Matrix3::Zero();
  const Scalar share = 1 / (1 + friction * friction);
  const Vector3 along(1, friction * x[1] / t, friction * x[2] / t);  // the cone's edge
  const Vector2 across(-x[2] / t, x[1] / t);
  const Scalar shrink = friction * (x[0] + friction * t) * share / t;
  Matrix3 D = share * along * along.transpose();
  D.bottomRightCorner<2, 2>() += shrink * across * across.transpose();
  return D;
}

Matrix3 disc_derivative(const Vector3& x, Scalar radius) {
  Matrix3 D = Matrix3::Zero();
  const Scalar length = x.head<2>().norm();
  if (length <= radius) {
    D(0, 0) = D(1, 1) = 1;
  } else if (radius > 0) {
    const Vector2 across(-x[1] / length, x[0] / length);
    D.topLeftCorner<2, 2>() = radius / length * across * across.transpose();
  }
  return D;
}

}  // namespace

Matrix3 project_derivative(const Block& block, const Vector3& x, Scalar normal) {
  const auto inside = [](bool is_inside) {
    Matrix3 D = Matrix3::Zero();
    D(0, 0) = is_inside ? 1 : 0;
    return D;
  };
  switch (block.kind) {
    case BlockKind::Contact:
      return cone_derivative(x, block.friction);
    case BlockKind::Row:
      return inside(x[0] > block.lower && x[0] < block.upper);
    case BlockKind::Rolling:
      return disc_derivative(x, normal);
    case BlockKind::Torsion:
      return inside(std::abs(x[0]) < normal);
  }
  return Matrix3::Zero();  // not reached
}

Vector3 project_onto_bounds(const Block& block, const Vector3& x, Scalar normal) {
  switch (block.kind) {
    case BlockKind::Contact:
      break;
    case BlockKind::Row:
      return {std::clamp(x[0], block.lower, block.upper), 0, 0};
    case BlockKind::Rolling: {
      const Vector2 p = clip(x.head<2>(), normal);
      return {p[0], p[1], 0};
    }
    case BlockKind::Torsion: {
      const Scalar bound = std::max(normal, Scalar{0});
      return {std::clamp(x[0], -bound, bound), 0, 0};
    }
  }
  return Vector3::Zero();  // not reached
}

}  // namespace dyop::contact_internal
