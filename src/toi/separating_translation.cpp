// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/separating_translation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"

namespace dyop {
namespace {

bool is_solid(const Shape& shape) {
  return shape.kind() == ShapeKind::TriangleMesh &&
         static_cast<const TriangleMesh&>(shape).is_closed();
}

// Direction i of n, spread evenly over the sphere along a spiral.
Vector3 spiral_direction(int i, int n) {
  const Scalar z = 1 - (2 * i + 1) / Scalar(n);
  const Scalar angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
  const Scalar radius = std::sqrt(1 - z * z);
  return {radius * std::cos(angle), radius * std::sin(angle), z};
}

// The shortest way out that was found.
class WayOut {
 public:
  WayOut(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB,
         Scalar tolerance)
      : a_(a),
        X_WA_(X_WA),
        b_(b),
        X_WB_(X_WB),
        best_(X_WA * a.bounding_box().center() - X_WB * b.bounding_box().center()),
        outside_(0) {
    toi_.distance_tolerance = tolerance;
    toi_.solid_a = distance_.solid_a = is_solid(a);
    toi_.solid_b = distance_.solid_b = is_solid(b);
    outside_ = a.bounding_radius() + b.bounding_radius() +
               (X_WA.translation() - X_WB.translation()).norm() + tolerance;
    depth_ = kInfinity;
  }

  bool is_overlapping() const {
    const DistanceStatus status = dyop::distance(a_, X_WA_, b_, X_WB_, distance_).status;
    return status != DistanceStatus::Separated;
  }

  // Moves B towards A from outside along -n, from the best depth if that is free, and keeps where
  // it is stopped. Returns whether that is nearer than before; then `contact` is the normal there.
  bool try_direction(const Vector3& n) {
    const Scalar start = std::min(outside_, depth_);
    const RestMotion at_rest(X_WA_);
    const ConstantTwistMotion inwards(
        RigidPose::from_trusted(X_WB_.rotation(), X_WB_.translation() + start * n),
        {-n, Vector3::Zero()});
    const ToiResult hit = time_of_impact(a_, at_rest, b_, inwards, {0, start}, toi_);
    if (hit.status != ToiStatus::Impact || !(hit.t_safe > 0)) return false;
    const Scalar depth = start - hit.t_safe;
    if (!(depth < depth_)) return false;
    depth_ = depth;
    best_ = n;
    contact_ = hit.contact->nhat_AB_W;
    p_W_ = hit.contact->pivot_W();
    return true;
  }

  // Takes B, or a half-space B, out along the half-space's normal, by the depth of the other's
  // lowest point: from a place where the two are apart, what is left between them is too much.
  void leave_half_space() {
    const HalfSpace* of_a = as_half_space(a_);
    const HalfSpace* of_b = as_half_space(b_);
    if (of_a && of_b) return;
    best_ = of_a ? Vector3(X_WA_.rotation() * of_a->normal())
                 : Vector3(-(X_WB_.rotation() * of_b->normal()));
    const Scalar size = (of_a ? b_ : a_).bounding_radius();
    const Scalar outside = (X_WA_.translation() - X_WB_.translation()).norm() + 2 * size +
                           std::abs((of_a ? of_a : of_b)->offset());
    const RigidPose X_WB =
        RigidPose::from_trusted(X_WB_.rotation(), X_WB_.translation() + outside * best_);
    const DistanceResult apart = dyop::distance(a_, X_WA_, b_, X_WB, distance_);
    depth_ = outside - apart.lower;
    p_W_ = of_a ? Vector3(apart.p_WCb - outside * best_) : apart.p_WCa;
  }

  // Follows the normals of the contacts that stop B.
  void follow_normals() {
    constexpr int kMostNormals = 20;
    for (int i = 0; i < kMostNormals && try_direction(contact_); ++i) {
    }
  }

  // Tries directions around the best one, at smaller and smaller angles.
  void refine() {
    constexpr int kRings = 6;
    constexpr int kAround = 6;
    Scalar angle = 0.3;
    for (int ring = 0; ring < kRings; ++ring, angle /= 3) {
      const Vector3 x = best_.unitOrthogonal();
      const Vector3 n = best_;
      const Vector3 y = n.cross(x);
      for (int k = 0; k < kAround; ++k) {
        const Scalar turn = 2 * std::numbers::pi * k / kAround;
        const Vector3 side = std::cos(turn) * x + std::sin(turn) * y;
        if (try_direction((n + std::tan(angle) * side).normalized())) follow_normals();
      }
    }
  }

  // With the proof: a distance at the end.
  std::optional<Penetration> result(Scalar tolerance) const {
    constexpr int kAttempts = 8;
    Scalar depth = depth_;
    for (int i = 0; i < kAttempts && depth < kInfinity; ++i) {
      const RigidPose X_WB =
          RigidPose::from_trusted(X_WB_.rotation(), X_WB_.translation() + depth * best_);
      if (dyop::distance(a_, X_WA_, b_, X_WB, distance_).status == DistanceStatus::Separated) {
        return Penetration{depth, best_, p_W_};
      }
      depth += tolerance;
    }
    return std::nullopt;
  }

 private:
  const Shape& a_;
  const RigidPose& X_WA_;
  const Shape& b_;
  const RigidPose& X_WB_;
  Vector3 best_;
  Scalar outside_;
  Scalar depth_;
  Vector3 contact_ = Vector3::UnitX();
  Vector3 p_W_ = Vector3::Zero();
  ToiOptions toi_;
  DistanceOptions distance_;
};

}  // namespace

std::optional<Penetration> separating_translation(const Shape& a, const RigidPose& X_WA,
                                                  const Shape& b, const RigidPose& X_WB,
                                                  const SeparationOptions& options) {
  constexpr int kMostDirections = 10000;
  DYOP_REQUIRE(options.directions >= 1 && options.directions <= kMostDirections,
               "separating_translation: directions must be in [1, ", kMostDirections, "], not ",
               options.directions);
  const Scalar tolerance =
      options.tolerance ? *options.tolerance : default_distance_tolerance(a, b);
  DYOP_REQUIRE(tolerance > 0 && tolerance < kInfinity,
               "separating_translation: tolerance must be finite and > 0, not ", tolerance);
  WayOut way(a, X_WA, b, X_WB, tolerance);
  if (!way.is_overlapping()) return std::nullopt;
  if (as_half_space(a) || as_half_space(b)) {
    way.leave_half_space();
    return way.result(tolerance);
  }
  for (int axis = 0; axis < 6; ++axis) {
    const Vector3 n = (axis < 3 ? 1 : -1) * Vector3::Unit(axis % 3);
    if (way.try_direction(n)) way.follow_normals();
  }
  for (int i = 0; i < options.directions; ++i) {
    if (way.try_direction(spiral_direction(i, options.directions))) way.follow_normals();
  }
  way.refine();
  return way.result(tolerance);
}

}  // namespace dyop
