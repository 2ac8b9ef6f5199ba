// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/distance_derivatives.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <ostream>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/triangle_mesh.h"
#include "geometry/shape_tree.h"

namespace dyop {
namespace {

// The twist of a unit rate along the first three or about the last three axes.
Twist unit_twist(int k) {
  Twist twist;
  (k < 3 ? twist.v_WB : twist.w_WB)[k % 3] = 1;
  return twist;
}

RigidPose moved(const RigidPose& X, int k, Scalar step) {
  const Twist way = unit_twist(k);
  return RigidPose::from_trusted(
      k < 3 ? X.rotation() : Matrix3(rotation_from_vector(step * way.w_WB) * X.rotation()),
      X.translation() + step * way.v_WB);
}

// The flat piece of a core that a witness point lies on, as a point and up to two directions in it.
struct FlatFeature {
  Vector3 point;
  std::array<Vector3, 2> spans{Vector3::Zero(), Vector3::Zero()};
  int dimension = 0;
};

const Shape& part_of(const Shape& shape, const std::optional<std::int32_t>& child, RigidPose& X) {
  if (!child) return shape;
  const auto& part = static_cast<const CompoundShape&>(shape).children()[std::size_t(*child)];
  X = X * part.X_CS;
  return *part.shape;
}

// Nothing for a smooth core, and a feature without extent.
std::optional<FlatFeature> flat_feature(const Shape& shape, RigidPose X_WS, const Feature& feature,
                                        const std::optional<std::int32_t>& child,
                                        const Vector3& p_WC, const Vector3& outward) {
  const Shape& part = part_of(shape, child, X_WS);
  if (feature.kind == FeatureKind::Smooth) return std::nullopt;
  const auto* convex =
      part.kind() == ShapeKind::Convex ? static_cast<const ConvexShape*>(&part) : nullptr;
  const TriangleMesh* mesh =
      convex ? convex->core_surface() : static_cast<const TriangleMesh*>(&part);
  if (mesh == nullptr) return std::nullopt;
  FlatFeature result;
  result.point = convex ? Vector3(p_WC - convex->rounding_radius() * outward) : p_WC;
  result.dimension = int(feature.vertex_count()) - 1;
  const auto corner = [&](std::size_t k) {
    return Vector3(mesh->vertices()[std::size_t(feature.vertices[k])]);
  };
  for (int k = 0; k < result.dimension; ++k) {
    Vector3 span = X_WS.rotation() * (corner(std::size_t(k) + 1) - corner(0));
    const Scalar length = span.norm();
    if (k == 1) span -= result.spans[0].dot(span) * result.spans[0];
    // literal: a sine below which three vertices span no plane worth the name.
    if (!(span.norm() > 1e-9 * length)) return std::nullopt;
    result.spans[std::size_t(k)] = span.normalized();
  }
  return result;
}

// How the nearest points of two flat features move with them: at all times the vector between the
// points is perpendicular to both, which is a linear system for the rates of the coordinates in
// the features.
class WitnessMotion {
 public:
  WitnessMotion(const FlatFeature& a, const FlatFeature& b)
      : a_(a), b_(b), D_(b.point - a.point), size_(a.dimension + b.dimension) {
    for (int i = 0; i < size_; ++i) {
      for (int j = 0; j < size_; ++j)
        system_(i, j) = (j < a_.dimension ? -1 : 1) * span(i).dot(span(j));
    }
    lu_.compute(system_.topLeftCorner(size_, size_));
  }

  // literal: sines below it count as parallel: nearest points are no longer unique.
  bool is_unique() const { return size_ == 0 || std::abs(lu_.determinant()) > 1e-9; }

  struct Rates {
    Vector3 a;  // of the points
    Vector3 b;
  };

  // While A (or B) moves with this twist, whose origin is at o.
  Rates rates(const Twist& twist, const Vector3& o, bool moves_a) const {
    const FlatFeature& moving = moves_a ? a_ : b_;
    const Vector3 carried = twist.v_WB + twist.w_WB.cross(moving.point - o);
    Rates result{moves_a ? carried : Vector3::Zero(), moves_a ? Vector3::Zero() : carried};
    if (size_ == 0) return result;
    const Vector3 parting = result.b - result.a;
    Small right(size_);
    for (int i = 0; i < size_; ++i) {
      const bool is_of_a = i < a_.dimension;
      right[i] = -span(i).dot(parting);
      if (is_of_a == moves_a) right[i] -= twist.w_WB.cross(span(i)).dot(D_);
    }
    const Small slide = lu_.solve(right);
    for (int i = 0; i < size_; ++i) (i < a_.dimension ? result.a : result.b) += slide[i] * span(i);
    return result;
  }

  Scalar length() const { return D_.norm(); }

 private:
  using Small = Eigen::Matrix<Scalar, Eigen::Dynamic, 1, 0, 4, 1>;
  using SmallMatrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic, 0, 4, 4>;

  const Vector3& span(int i) const {
    return i < a_.dimension ? a_.spans[std::size_t(i)] : b_.spans[std::size_t(i - a_.dimension)];
  }

  const FlatFeature& a_;
  const FlatFeature& b_;
  const Vector3 D_;
  const int size_;
  Eigen::Matrix<Scalar, 4, 4> system_;
  Eigen::PartialPivLU<SmallMatrix> lu_;
};

Scalar rounding_radius(const Shape& shape) {
  if (shape.kind() != ShapeKind::Convex) return 0;
  return static_cast<const ConvexShape&>(shape).rounding_radius();
}

Scalar rounding_of(const Shape& shape, const std::optional<std::int32_t>& child) {
  RigidPose unused;
  return rounding_radius(part_of(shape, child, unused));
}

void set_column(PoseJacobian& jacobian, int k, const Vector3& column) {
  (k < 3 ? jacobian.translation : jacobian.rotation).col(k % 3) = column;
}

Vector3 column(const PoseJacobian& jacobian, int k) {
  return (k < 3 ? jacobian.translation : jacobian.rotation).col(k % 3);
}

class Derivation {
 public:
  Derivation(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB)
      : a_(a), X_WA_(X_WA), b_(b), X_WB_(X_WB) {}

  DistanceDerivatives run(Scalar tolerance) {
    DistanceDerivatives result;
    result.distance = at(X_WA_);
    const DistanceResult& here = result.distance;
    if (!(here.lower > 0)) {
      result.status = DerivativeStatus::Touching;
      return result;
    }
    const Vector3& n = here.nhat_AB_W;
    result.by_a = {-n, -(here.p_WCa - X_WA_.translation()).cross(n)};
    result.by_b = {n, (here.p_WCb - X_WB_.translation()).cross(n)};
    result.witness = witness(here);
    result.error = 0;
    for (int k = 0; k < 6; ++k) probe(k, result);
    // False for NaN: flagged.
    const bool is_proven = result.error <= tolerance;
    const auto flag = has_corner_ ? DerivativeStatus::Tie : DerivativeStatus::Unproven;
    result.status = is_proven ? DerivativeStatus::Proven : flag;
    if (result.status != DerivativeStatus::Proven) result.witness.reset();
    return result;
  }

 private:
  DistanceResult at(const RigidPose& X_WA) {
    return distance(a_, X_WA, b_, X_WB_, DistanceOptions(), cache_);
  }

  std::optional<WitnessJacobians> witness(const DistanceResult& here) const {
    const Vector3& n = here.nhat_AB_W;
    const auto on_a = flat_feature(a_, X_WA_, here.feature_a, here.child_a, here.p_WCa, n);
    const auto on_b = flat_feature(b_, X_WB_, here.feature_b, here.child_b, here.p_WCb, -n);
    if (!on_a || !on_b) return std::nullopt;
    const WitnessMotion motion(*on_a, *on_b);
    if (!motion.is_unique()) return std::nullopt;
    const Scalar radius_a = rounding_of(a_, here.child_a);
    const Scalar radius_b = rounding_of(b_, here.child_b);
    WitnessJacobians result;
    for (int k = 0; k < 6; ++k) {
      for (const bool moves_a : {true, false}) {
        const Vector3 o = moves_a ? X_WA_.translation() : X_WB_.translation();
        const WitnessMotion::Rates rates = motion.rates(unit_twist(k), o, moves_a);
        const Vector3 parting = rates.b - rates.a;
        const Vector3 turning = (parting - n.dot(parting) * n) / motion.length();
        set_column(moves_a ? result.nhat_by_a : result.nhat_by_b, k, turning);
        set_column(moves_a ? result.p_WCa_by_a : result.p_WCa_by_b, k,
                   rates.a + radius_a * turning);
        set_column(moves_a ? result.p_WCb_by_a : result.p_WCb_by_b, k,
                   rates.b - radius_b * turning);
      }
    }
    return result;
  }

  // Of a half-space what matters; twice as far, for the poses that are tried.
  Scalar radius_a() const { return geometry_internal::radius_beside(a_, b_, apart()); }
  Scalar radius_b() const { return geometry_internal::radius_beside(b_, a_, apart()); }
  Scalar apart() const { return 2 * (X_WB_.translation() - X_WA_.translation()).norm(); }

  // Bounds the one-sided derivatives along one axis, and compares the witness with its Jacobian.
  void probe(int k, DistanceDerivatives& result) {
    const DistanceResult& here = result.distance;
    // Largest speed and acceleration of points of A.
    const Scalar reach = k < 3 ? 1 : radius_a();
    const Scalar bend = k < 3 ? 0 : reach;
    if (!(reach > 0)) return;  // a point does not turn
    const Scalar noise = here.upper - here.lower +
                         kPoseNoise * (X_WA_.translation().norm() + X_WB_.translation().norm() +
                                       radius_a() + radius_b());
    // No pair of points comes nearer than half of the distance within the step. Points of cores are
    // farther apart, by the radii of the balls that inflate them.
    const Scalar rounding = rounding_radius(a_) + rounding_radius(b_);
    const auto curvature_within = [&](Scalar step) {
      return reach * reach / (here.lower + rounding - reach * step) + bend;
    };
    const Scalar longest = here.lower / (2 * reach);
    const Scalar step = std::min(longest, std::sqrt(2 * noise / curvature_within(longest)));
    const DistanceResult plus = at(moved(X_WA_, k, step));
    const DistanceResult minus = at(moved(X_WA_, k, -step));
    const Scalar slack = noise / step + curvature_within(step) * step / 2;
    const Scalar right = (plus.lower - here.upper) / step - slack;
    const Scalar left = (here.upper - minus.lower) / step + slack;
    const Scalar derivative = k < 3 ? result.by_a.translation[k] : result.by_a.rotation[k - 3];
    const Scalar error = std::max(derivative - right, left - derivative) / reach;
    // The slopes differ by more than a distance without a corner could.
    has_corner_ = has_corner_ || reach * error > 2 * slack;
    if (!(error <= result.error)) result.error = error;  // NaN stays
    if (result.witness && !agrees(*result.witness, k, {minus, here, plus}, step, reach)) {
      result.witness.reset();
    }
  }

  // Whether witness points and normal moved as the Jacobians say, before and behind the pose, at
  // which points of A move at most at the speed `reach`.
  static bool agrees(const WitnessJacobians& jacobians, int k,
                     const std::array<DistanceResult, 3>& row, Scalar step, Scalar reach) {
    // Largest difference, relative to the rates: what a step changes is small, a jump is not.
    constexpr Scalar kDifference = 0.02;
    const auto is_near = [&](const Vector3& from, const Vector3& to, const PoseJacobian& J,
                             Scalar scale) {
      const Vector3 rate = column(J, k);
      return ((to - from) / step - rate).norm() <= kDifference * (rate.norm() + scale);
    };
    const Scalar turning = reach / row[1].lower;
    for (std::size_t i = 0; i + 1 < row.size(); ++i) {
      if (!is_near(row[i].p_WCa, row[i + 1].p_WCa, jacobians.p_WCa_by_a, reach) ||
          !is_near(row[i].p_WCb, row[i + 1].p_WCb, jacobians.p_WCb_by_a, reach) ||
          !is_near(row[i].nhat_AB_W, row[i + 1].nhat_AB_W, jacobians.nhat_by_a, turning)) {
        return false;
      }
    }
    return true;
  }

  const Shape& a_;
  const RigidPose& X_WA_;
  const Shape& b_;
  const RigidPose& X_WB_;
  DistanceCache cache_;
  bool has_corner_ = false;
};

}  // namespace

std::string_view name_of(DerivativeStatus status) {
  switch (status) {
    case DerivativeStatus::NotRun:
      return "NotRun";
    case DerivativeStatus::Proven:
      return "Proven";
    case DerivativeStatus::Unproven:
      return "Unproven";
    case DerivativeStatus::Tie:
      return "Tie";
    case DerivativeStatus::Touching:
      return "Touching";
    case DerivativeStatus::Grazing:
      return "Grazing";
  }
  return "NotRun";
}

std::ostream& operator<<(std::ostream& out, DerivativeStatus status) {
  return out << name_of(status);
}

DistanceDerivatives distance_derivatives(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                         const RigidPose& X_WB, const DerivativeOptions& options) {
  DYOP_REQUIRE(options.tolerance > 0, "distance_derivatives: tolerance must be > 0, not ",
               options.tolerance);
  return Derivation(a, X_WA, b, X_WB).run(options.tolerance);
}

}  // namespace dyop
