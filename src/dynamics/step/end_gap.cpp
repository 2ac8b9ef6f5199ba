// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/end_gap.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/tolerance.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/convex_shape.h"

namespace dyop::internal {
namespace {

Scalar rounding_radius(const Shape& shape) {
  if (shape.kind() != ShapeKind::Convex) return 0;
  return static_cast<const ConvexShape&>(shape).rounding_radius();
}

bool is_smooth_core(const Shape& shape) {
  return shape.kind() == ShapeKind::Convex &&
         static_cast<const ConvexShape&>(shape).core_surface() == nullptr;
}

}  // namespace

Scalar end_gap(const ContactPoint& point, const BodyRecord& a, const RigidPose& X_WA,
               const RigidPose& X_WA_end, const BodyRecord& b, const RigidPose& X_WB,
               const RigidPose& X_WB_end) {
  const Shape& shape_a = *a.definition.shape;
  const Shape& shape_b = *b.definition.shape;
  if (is_smooth_core(shape_a) || is_smooth_core(shape_b)) {
    // Their one contact slides over the surface: a distance query finds it.
    const DistanceResult result = distance(shape_a, X_WA_end, shape_b, X_WB_end);
    if (result.lower > 0) return result.upper;
  }
  const Scalar radius_a = rounding_radius(shape_a);
  const Scalar radius_b = rounding_radius(shape_b);
  const Vector3& n = point.nhat_AB_W;
  const Vector3 core_a = X_WA_end * (point.p_ACa - radius_a * (X_WA.rotation().transpose() * n));
  const Vector3 core_b = X_WB_end * (point.p_BCb + radius_b * (X_WB.rotation().transpose() * n));
  const bool are_vertices =
      point.feature_a.kind == FeatureKind::Vertex && point.feature_b.kind == FeatureKind::Vertex;
  if (are_vertices && (core_b - core_a).dot(n) > 0) {
    return (core_b - core_a).norm() - radius_a - radius_b;
  }
  const Matrix3& R_end = point.normal_is_of_b ? X_WB_end.rotation() : X_WA_end.rotation();
  return (R_end * point.nhat_AB_S).dot(core_b - core_a) - radius_a - radius_b;
}

Scalar closing_at_dip(Scalar room, Scalar error) {
  return error > 0 ? 2 * std::sqrt(error * std::max(room, Scalar{0})) : kInfinity;
}

bool is_on_curved_surface(const ContactPoint& point, const BodyRecord& a, const BodyRecord& b) {
  if (point.merged_way > 0) return true;
  const Shape& shape_a = *a.definition.shape;
  const Shape& shape_b = *b.definition.shape;
  return (rounding_radius(shape_a) > 0 && shape_b.kind() == ShapeKind::TriangleMesh) ||
         (rounding_radius(shape_b) > 0 && shape_a.kind() == ShapeKind::TriangleMesh);
}

std::optional<Scalar> measured_end_gap(const ContactPoint& point, const CurvedMove& move,
                                       const PairLengths& lengths, const BodyRecord& a,
                                       const RigidPose& X_WA_end, const BodyRecord& b,
                                       const RigidPose& X_WB_end, ContactWorkspace& workspace) {
  if (!(move.way > kContactMergedChange * lengths.standoff)) return std::nullopt;
  const Scalar sagitta = move.way * move.way / lengths.radius;
  const Scalar lift = std::max(0.0, sagitta - move.end_gap);
  const Scalar reach = std::max(move.end_gap, lengths.rest_gap()) + lengths.standoff + sagitta;
  const Scalar near = std::max(kContactMeasuredWays * move.way, point.merged_way);
  const Vector3& n = point.nhat_AB_W;
  const RigidPose lifted =
      RigidPose::from_trusted(X_WB_end.rotation(), X_WB_end.translation() + lift * n);
  std::vector<ContactPoint> found;
  generate_contacts(*a.definition.shape, X_WA_end, *b.definition.shape, lifted, reach + lift, {},
                    workspace, found);
  const Vector3 p_a = X_WA_end * point.p_ACa;
  const Vector3 p_b = X_WB_end * point.p_BCb;
  std::optional<Scalar> least;
  for (const ContactPoint& other : found) {
    const Scalar cosine = other.nhat_AB_W.dot(n);
    const Scalar apart =
        std::min((other.p_WCa - p_a).squaredNorm(), (other.p_WCa - p_b).squaredNorm());
    if (cosine < kContactMergedCosine || apart > near * near) continue;
    const Scalar gap = other.gap - lift * cosine;
    least = std::min(gap, least.value_or(gap));
  }
  return least;
}

ContactPoint point_of_hit(const ToiResult& hit, const RigidPose& X_WA, const RigidPose& X_WB) {
  const ImpactContact& found = *hit.contact;
  ContactPoint point;
  point.p_ACa = hit.X_WA.inverse() * found.p_WCa;
  point.p_BCb = hit.X_WB.inverse() * found.p_WCb;
  point.feature_a = found.feature_a;
  point.feature_b = found.feature_b;
  point.normal_is_of_b = found.feature_b.kind == FeatureKind::Face;
  const RigidPose& X_WS = point.normal_is_of_b ? hit.X_WB : hit.X_WA;
  point.nhat_AB_S = X_WS.rotation().transpose() * found.nhat_AB_W;
  point.p_WCa = X_WA * point.p_ACa;
  point.p_WCb = X_WB * point.p_BCb;
  point.nhat_AB_W =
      ((point.normal_is_of_b ? X_WB : X_WA).rotation() * point.nhat_AB_S).normalized();
  point.gap = point.nhat_AB_W.dot(point.p_WCb - point.p_WCa);
  return point;
}

}  // namespace dyop::internal
