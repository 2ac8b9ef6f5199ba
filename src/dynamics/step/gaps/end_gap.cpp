// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/gaps/end_gap.h"

#include <algorithm>
#include <cmath>

#include "dynamics/step/gaps/rounded_core.h"
#include "dyop/distance/distance.h"
#include "dyop/distance/triangle_distance.h"
#include "dyop/geometry/triangle_mesh.h"
#include "geometry/shape_part.h"

namespace dyop::dynamics_internal {
namespace {

bool is_smooth_core(const Shape& shape) {
  return shape.kind() == ShapeKind::Convex &&
         static_cast<const ConvexShape&>(shape).core_surface() == nullptr;
}

Vector3 between(const Vector3& p, const Vector3& q) {
  return (p + q) / 2;
}

// A vertex or an edge of a convex shape's core, in world, as a triangle without area.
std::optional<Triangle> thin_feature(const Shape& shape, const Feature& feature,
                                     const RigidPose& X_W) {
  if (shape.kind() != ShapeKind::Convex) return std::nullopt;
  if (feature.kind != FeatureKind::Vertex && feature.kind != FeatureKind::Edge) return std::nullopt;
  const TriangleMesh& core = *static_cast<const ConvexShape&>(shape).core_surface();
  const auto corner = [&](std::size_t k) -> Vector3 {
    return X_W * core.vertices()[std::size_t(feature.vertices[k])];
  };
  const Vector3 last = corner(feature.vertex_count() - 1);
  return Triangle{corner(0), last, last};
}

// Points and edges that roll on each other, one of them rounded: their nearest points move over
// both.
std::optional<EndGap> rounded_end_gap(const ContactPoint& point, const Shape& a,
                                      const RigidPose& X_WA_end, const Shape& b,
                                      const RigidPose& X_WB_end) {
  const Scalar radius_a = rounding_radius(a);
  const Scalar radius_b = rounding_radius(b);
  if (radius_a + radius_b == 0) return std::nullopt;
  const auto core_a = thin_feature(a, point.feature_a, X_WA_end);
  const auto core_b = thin_feature(b, point.feature_b, X_WB_end);
  if (!core_a || !core_b) return std::nullopt;
  const TriangleDistance nearest = triangle_distance(*core_a, *core_b);
  const Vector3 way = nearest.p_b - nearest.p_a;
  const Scalar length = way.norm();
  if (!(length > 0)) return std::nullopt;
  const Vector3 n = way / length;
  return EndGap{length - radius_a - radius_b,
                between(nearest.p_a + radius_a * n, nearest.p_b - radius_b * n)};
}

}  // namespace

bool is_edge_pair(const ContactPoint& point) {
  return point.feature_a.kind == FeatureKind::Edge && point.feature_b.kind == FeatureKind::Edge;
}

EndGap end_gap(const ContactPoint& point, const BodyRecord& a, const RigidPose& X_WA,
               const RigidPose& X_WA_end, const BodyRecord& b, const RigidPose& X_WB,
               const RigidPose& X_WB_end) {
  const Shape& shape_a = shape_part(*a.definition.shape, point.key.a.piece);
  const Shape& shape_b = shape_part(*b.definition.shape, point.key.b.piece);
  if (is_smooth_core(shape_a) || is_smooth_core(shape_b)) {
    // Their one contact slides over the surface: a distance query finds it.
    const DistanceResult result = distance(shape_a, X_WA_end, shape_b, X_WB_end);
    if (result.lower > 0) return {result.upper, between(result.p_WCa, result.p_WCb)};
  } else if (const auto rounded = rounded_end_gap(point, shape_a, X_WA_end, shape_b, X_WB_end)) {
    return *rounded;
  }
  const Scalar radius_a = rounding_radius(shape_a);
  const Scalar radius_b = rounding_radius(shape_b);
  const Vector3& n = point.nhat_AB_W;
  const Vector3 core_a = X_WA_end * (point.p_ACa - radius_a * (X_WA.rotation().transpose() * n));
  const Vector3 core_b = X_WB_end * (point.p_BCb + radius_b * (X_WB.rotation().transpose() * n));
  const Matrix3& R_end = point.normal_is_of_b ? X_WB_end.rotation() : X_WA_end.rotation();
  const Vector3 n_end = R_end * point.nhat_AB_S;
  EndGap end{n_end.dot(core_b - core_a) - radius_a - radius_b};
  // A vertex stays where it is on its body.
  if (point.feature_a.kind == FeatureKind::Vertex) {
    end.p_W = core_a + (radius_a + end.gap / 2) * n_end;
  } else if (point.feature_b.kind == FeatureKind::Vertex) {
    end.p_W = core_b - (radius_b + end.gap / 2) * n_end;
  } else {
    // Where edges cross is on both. Exact where the bodies do not slide on each other.
    end.p_W = between(core_a + radius_a * n_end, core_b - radius_b * n_end);
  }
  return end;
}

Scalar closing_at_dip(Scalar room, Scalar error) {
  return error > 0 && room < error ? 2 * std::sqrt(error * std::max(room, Scalar{0})) : kInfinity;
}

ContactPoint point_of_hit(const ToiResult& hit, const RigidPose& X_WA, const RigidPose& X_WB) {
  const ImpactContact& found = *hit.contact;
  ContactPoint point;
  point.p_ACa = hit.X_WA.inverse() * found.p_WCa;
  point.p_BCb = hit.X_WB.inverse() * found.p_WCb;
  point.key.a.piece = found.child_a.value_or(0);
  point.key.b.piece = found.child_b.value_or(0);
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

}  // namespace dyop::dynamics_internal
