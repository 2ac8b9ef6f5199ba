// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/hit_contacts.h"

#include <utility>

#include "dynamics/step/end_gap.h"
#include "dyop/geometry/convex_shape.h"
#include "geometry/shape_tree.h"

namespace dyop::dynamics_internal {

namespace {

// Cosine of the angle up to which contacts face the same way as the hit.
constexpr Scalar kSameWay = 0.99;

const Shape& part_of(const BodyRecord& body, const FeatureKey& key) {
  return shape_part(*body.definition.shape, key.piece);
}

Scalar rounding_radius_of(const Shape& shape) {
  if (shape.kind() != ShapeKind::Convex) return 0;
  return static_cast<const ConvexShape&>(shape).rounding_radius();
}

// No facets: what spins about its axis keeps its point of contact.
bool is_smooth(const Shape& shape) {
  return shape.kind() == ShapeKind::Convex &&
         static_cast<const ConvexShape&>(shape).core_surface() == nullptr;
}

// Moves a contact at the poses of the hit back. A ball or a cylinder that spins does not take the
// point where it is hit with it.
void carry_back(const ToiResult& hit, const HitPair& pair, ContactPoint& point) {
  const Vector3 nhat_hit = point.nhat_AB_W;
  const RigidPose& X_WS = point.normal_is_of_b ? pair.X_WB : pair.X_WA;
  point.nhat_AB_W = (X_WS.rotation() * point.nhat_AB_S).normalized();
  const auto carried = [&](const Vector3& p_W, const BodyRecord& body, const FeatureKey& key,
                           Scalar sign, const RigidPose& X_hit, const RigidPose& X_W) -> Vector3 {
    const Shape& part = part_of(body, key);
    if (is_smooth(part)) {
      const Vector3& center = body.definition.mass_properties.p_BoBcm;
      return p_W + (X_W * center - X_hit * center);
    }
    const Scalar radius = sign * rounding_radius_of(part);
    const Vector3 core = X_hit.inverse() * Vector3(p_W + radius * nhat_hit);
    return X_W * core - radius * point.nhat_AB_W;
  };
  point.p_WCa = carried(point.p_WCa, pair.a, point.key.a, -1, hit.X_WA, pair.X_WA);
  point.p_WCb = carried(point.p_WCb, pair.b, point.key.b, 1, hit.X_WB, pair.X_WB);
  point.p_ACa = pair.X_WA.inverse() * point.p_WCa;
  point.p_BCb = pair.X_WB.inverse() * point.p_WCb;
  point.gap = point.nhat_AB_W.dot(point.p_WCb - point.p_WCa);
}

ContactPoint point_of_hit(const ToiResult& hit) {
  const ImpactContact& found = *hit.contact;
  ContactPoint point;
  point.key.a.piece = found.child_a.value_or(0);
  point.key.b.piece = found.child_b.value_or(0);
  point.feature_a = found.feature_a;
  point.feature_b = found.feature_b;
  point.p_WCa = found.p_WCa;
  point.p_WCb = found.p_WCb;
  point.nhat_AB_W = found.nhat_AB_W;
  point.normal_is_of_b = found.feature_b.kind == FeatureKind::Face;
  const RigidPose& X_WS = point.normal_is_of_b ? hit.X_WB : hit.X_WA;
  point.nhat_AB_S = X_WS.rotation().transpose() * found.nhat_AB_W;
  return point;
}

}  // namespace

std::vector<ContactPoint> contacts_of_hit(const ToiResult& hit, const HitPair& pair, Scalar reach,
                                          ContactWorkspace& workspace) {
  std::vector<ContactPoint> points{point_of_hit(hit)};
  const Shape& a = *pair.a.definition.shape;
  const Shape& b = *pair.b.definition.shape;
  if (a.kind() == ShapeKind::Convex && b.kind() == ShapeKind::Convex) {
    std::vector<ContactPoint> beside;
    generate_contacts(a, hit.X_WA, b, hit.X_WB, reach, {}, workspace, beside);
    std::erase_if(beside, [&](const ContactPoint& point) {
      return !(point.nhat_AB_W.dot(hit.contact->nhat_AB_W) > kSameWay);
    });
    // The place of the hit on a line or a face that meets is any of it.
    if (beside.size() > 1) {
      reduce_contacts({}, beside);
      points = std::move(beside);
    }
  }
  for (ContactPoint& point : points) carry_back(hit, pair, point);
  return points;
}

Vector3 acting_point(const ContactPoint& hit) {
  const Vector3 half = hit.gap / 2 * hit.nhat_AB_W;
  const FeatureKind a = hit.feature_a.kind;
  const FeatureKind b = hit.feature_b.kind;
  const bool is_of_a = b == FeatureKind::Face || (a == FeatureKind::Vertex && !is_on_face(hit));
  const bool is_of_b = a == FeatureKind::Face || (b == FeatureKind::Vertex && !is_on_face(hit));
  if (is_of_a == is_of_b) return (hit.p_WCa + hit.p_WCb) / 2;
  return is_of_a ? Vector3(hit.p_WCa + half) : Vector3(hit.p_WCb - half);
}

}  // namespace dyop::dynamics_internal
