// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/overlap.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/tolerance.h"
#include "distance/pivot_seed.h"
#include "dyop/contact/contact_reduction.h"
#include "dyop/distance/penetration.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/constant_twist_motion.h"
#include "dyop/motion/rest_motion.h"
#include "dyop/toi/time_of_impact.h"

namespace dyop::dynamics_internal {
namespace {

// The direction of least overlap of the bodies' boxes, towards B.
Vector3 direction_of_boxes(const Shape& a, const RigidPose& X_WA, const Shape& b,
                           const RigidPose& X_WB) {
  const AlignedBox box_a = posed_box(a, X_WA);
  const AlignedBox box_b = posed_box(b, X_WB);
  const Vector3 up = box_a.max() - box_b.min();    // how far B must go along each axis
  const Vector3 down = box_b.max() - box_a.min();  // and against it
  Eigen::Index axis_up = 0;
  Eigen::Index axis_down = 0;
  const Scalar least_up = up.minCoeff(&axis_up);
  const Scalar least_down = down.minCoeff(&axis_down);
  return least_up <= least_down ? Vector3(Vector3::Unit(axis_up))
                                : Vector3(-Vector3::Unit(axis_down));
}

// The normal of a triangle of a closed mesh, out of it; zero for anything else.
Vector3 outward_normal(const Shape& shape, const RigidPose& X_WS,
                       const std::optional<std::int32_t>& triangle) {
  if (shape.kind() != ShapeKind::TriangleMesh || !triangle) return Vector3::Zero();
  const auto& mesh = static_cast<const TriangleMesh&>(shape);
  if (!mesh.is_closed()) return Vector3::Zero();
  const Triangle corners = mesh.triangle(*triangle);
  const Vector3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  return normal.norm() > 0 ? Vector3(X_WS.rotation() * normal.normalized()) : Vector3::Zero();
}

// The mean normal of the faces that cross, from A to B; zero if they say nothing.
Vector3 direction_of_faces(const Shape& a, const RigidPose& X_WA, const Shape& b,
                           const RigidPose& X_WB) {
  Vector3 sum = Vector3::Zero();
  for (const Contact& contact : find_contacts(a, X_WA, b, X_WB, 0)) {
    sum +=
        outward_normal(a, X_WA, contact.triangle_a) - outward_normal(b, X_WB, contact.triangle_b);
  }
  constexpr Scalar kClear = 0.1;  // faces that point everywhere leave less than this of each
  return sum.norm() > kClear ? Vector3(sum.normalized()) : Vector3::Zero();
}

Vector3 direction_of(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB) {
  if (a.kind() == ShapeKind::Convex && b.kind() == ShapeKind::Convex) {
    const auto found = find_penetration(static_cast<const ConvexShape&>(a), X_WA,
                                        static_cast<const ConvexShape&>(b), X_WB);
    if (found && std::abs(found->nhat_AB_W.norm() - 1) < kRotationTolerance) {
      return found->nhat_AB_W;
    }
    return direction_of_boxes(a, X_WA, b, X_WB);
  }
  const Vector3 faces = direction_of_faces(a, X_WA, b, X_WB);
  return faces.isZero(0) ? direction_of_boxes(a, X_WA, b, X_WB) : faces;
}

// How far B has to go along the direction to be free, coming from far outside.
std::optional<Scalar> way_out(const Shape& a, const RigidPose& X_WA, const Shape& b,
                              const RigidPose& X_WB, const Vector3& nhat_AB_W, Scalar gap) {
  const Scalar far = (X_WB.translation() - X_WA.translation()).norm() + a.bounding_radius() +
                     b.bounding_radius() + 2 * gap;
  const RigidPose start(X_WB.rotation(), X_WB.translation() + far * nhat_AB_W);
  const ConstantTwistMotion approach(start, Twist{-nhat_AB_W, Vector3::Zero()});
  ToiOptions options;
  options.target_distance = gap / 2;
  options.distance_tolerance = gap / 2;
  const ToiResult met =
      time_of_impact(a, RestMotion(X_WA), b, approach, TimeInterval{0, far}, options);
  if (met.status != ToiStatus::Impact) return std::nullopt;
  return far - met.t_safe;
}

}  // namespace

std::vector<ContactPoint> estimate_overlap(const BodyRecord& a, const RigidPose& X_WA,
                                           const BodyRecord& b, const RigidPose& X_WB, Scalar gap,
                                           ContactWorkspace& workspace) {
  const Shape& shape_a = *a.definition.shape;
  const Shape& shape_b = *b.definition.shape;
  const Vector3 nhat = direction_of(shape_a, X_WA, shape_b, X_WB);
  const auto travel = way_out(shape_a, X_WA, shape_b, X_WB, nhat, gap);
  std::vector<ContactPoint> points;
  if (!travel) return points;
  const RigidPose X_WB_out(X_WB.rotation(), X_WB.translation() + *travel * nhat);
  generate_contacts(shape_a, X_WA, shape_b, X_WB_out, 2 * gap, {}, workspace, points);
  // Only what is pushed on the way out, and not all of it.
  std::erase_if(points,
                [&](const ContactPoint& point) { return !(point.nhat_AB_W.dot(nhat) > 0.5); });
  reduce_contacts({}, points);
  for (ContactPoint& point : points) {
    point.p_WCb -= *travel * nhat;
    point.gap = point.nhat_AB_W.dot(point.p_WCb - point.p_WCa);
    point.lower = 0;
    point.upper = 0;
  }
  return points;
}

}  // namespace dyop::dynamics_internal
