// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/end_gap.h"

#include <algorithm>
#include <cmath>

#include "contact/generation/contact_fit.h"
#include "contact/generation/contact_search.h"
#include "contact/generation/flat_contacts.h"
#include "contact/generation/placed_contacts.h"
#include "core/tolerance.h"
#include "dyop/distance/distance.h"
#include "dyop/distance/triangle_distance.h"
#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/triangle_mesh.h"
#include "geometry/shape_tree.h"

namespace dyop::dynamics_internal {

namespace {

/// Radius of the ball that inflates a convex shape's core; 0 for other shapes.
inline Scalar rounding_radius(const Shape& shape) {
  if (shape.kind() != ShapeKind::Convex) return 0;
  return static_cast<const ConvexShape&>(shape).rounding_radius();
}

// A half-space is flat, wherever it is touched.
bool is_smooth_core(const Shape& shape) {
  return !as_half_space(shape) && shape.kind() == ShapeKind::Convex &&
         static_cast<const ConvexShape&>(shape).core_surface() == nullptr;
}

bool is_mesh(const Shape& shape) {
  return shape.kind() == ShapeKind::TriangleMesh;
}

Vector3 between(const Vector3& p, const Vector3& q) {
  return (p + q) / 2;
}

// The mesh that a feature belongs to: a mesh itself, or a convex shape's core.
const TriangleMesh* surface_of(const Shape& shape) {
  if (shape.kind() == ShapeKind::TriangleMesh) return &static_cast<const TriangleMesh&>(shape);
  if (shape.kind() == ShapeKind::Convex) {
    return static_cast<const ConvexShape&>(shape).core_surface();
  }
  return nullptr;
}

// A vertex or an edge of a surface, in world, as a triangle without area.
std::optional<Triangle> thin_feature(const Shape& shape, const Feature& feature,
                                     const RigidPose& X_W) {
  if (feature.kind != FeatureKind::Vertex && feature.kind != FeatureKind::Edge) return std::nullopt;
  const TriangleMesh* surface = surface_of(shape);
  if (!surface) return std::nullopt;
  const auto corner = [&](std::size_t k) -> Vector3 {
    return X_W * surface->vertices()[std::size_t(feature.vertices[k])];
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
  const Vector3 travel = nearest.p_b - nearest.p_a;
  const Scalar length = travel.norm();
  if (!(length > 0)) return std::nullopt;
  const Vector3 n = travel / length;
  return EndGap{length - radius_a - radius_b,
                between(nearest.p_a + radius_a * n, nearest.p_b - radius_b * n)};
}

// Below this sine of the angle between two edges their common normal is no longer certain.
constexpr Scalar kCrossingSine = 0.1;
// A contact of two edges whose normal is theirs, not that of a face beside them.
constexpr Scalar kCommonNormal = 1 - 1e-6;  // literal: cosine

// Direction of an edge in its shape's frame, of any length.
std::optional<Vector3> edge_direction(const Shape& shape, const Feature& feature) {
  if (feature.kind != FeatureKind::Edge) return std::nullopt;
  const TriangleMesh* mesh = surface_of(shape);
  if (!mesh) return std::nullopt;
  return mesh->vertices()[std::size_t(feature.vertices[1])] -
         mesh->vertices()[std::size_t(feature.vertices[0])];
}

// Two edges that cross slide along each other, and their common normal turns with both: the gap is
// that of the two lines.
std::optional<EndGap> crossing_end_gap(const ContactPoint& point, const Shape& a,
                                       const RigidPose& X_WA, const RigidPose& X_WA_end,
                                       const Shape& b, const RigidPose& X_WB,
                                       const RigidPose& X_WB_end) {
  if (rounding_radius(a) + rounding_radius(b) > 0) return std::nullopt;
  const auto edge_a = edge_direction(a, point.feature_a);
  const auto edge_b = edge_direction(b, point.feature_b);
  if (!edge_a || !edge_b) return std::nullopt;
  const Vector3 along_a = edge_a->normalized();
  const Vector3 along_b = edge_b->normalized();
  const auto common_normal = [&](const RigidPose& X_a, const RigidPose& X_b) -> Vector3 {
    return (X_a.rotation() * along_a).cross(X_b.rotation() * along_b);
  };
  const Vector3 before = common_normal(X_WA, X_WB);
  const Vector3 after = common_normal(X_WA_end, X_WB_end);
  const Scalar cosine = before.dot(point.nhat_AB_W);
  if (!(std::min(before.norm(), after.norm()) > kCrossingSine)) return std::nullopt;
  if (!(std::abs(cosine) > kCommonNormal * before.norm())) return std::nullopt;
  const Vector3 n = (cosine > 0 ? after : Vector3(-after)).normalized();
  const Vector3 p_a = X_WA_end * point.p_ACa;
  const Vector3 p_b = X_WB_end * point.p_BCb;
  const Vector3 u = X_WA_end.rotation() * along_a;
  const Vector3 v = X_WB_end.rotation() * along_b;
  const Vector3 apart = p_b - p_a;
  const Scalar s = apart.cross(v).dot(after) / after.squaredNorm();
  const Scalar t = apart.cross(u).dot(after) / after.squaredNorm();
  return EndGap{n.dot(apart), between(p_a + s * u, p_b + t * v)};
}

}  // namespace

// Corners.

namespace {

// Cosine of 15 degrees: shapes whose normal turns farther in a substep pass each other. Bodies that
// rest edge on edge turn it by less.
constexpr Scalar kPassingCosine = 0.966;

// A direction may rise above a surface that it leaves by this sine: the seam of two tiles.
constexpr Scalar kLeavingSine = 1e-6;  // literal: a sine

/// A vertex or an edge of a surface, at one pose.
struct Corner {
  const TriangleMesh* mesh = nullptr;
  Feature feature;
  Scalar radius = 0;  // of the ball that rounds it
};

std::optional<Corner> corner_of(const Shape& shape, const Feature& feature) {
  if (feature.kind != FeatureKind::Vertex && feature.kind != FeatureKind::Edge) return std::nullopt;
  const TriangleMesh* surface = surface_of(shape);
  if (!surface) return std::nullopt;
  return Corner{surface, feature, rounding_radius(shape)};
}

// Calls visit(triangle) for each triangle at the corner.
template <typename Visit>
void for_each_face(const Corner& corner, const Visit& visit) {
  const std::int32_t first = corner.feature.vertices[0];
  for (const std::int32_t side : corner.mesh->topology().corners_of_vertex(first)) {
    const TriangleIndices& t = corner.mesh->triangles()[std::size_t(side / 3)];
    const bool is_beside = corner.feature.kind == FeatureKind::Vertex ||
                           std::find(t.begin(), t.end(), corner.feature.vertices[1]) != t.end();
    if (is_beside) visit(corner.mesh->triangle(side / 3));
  }
}

// Whether no face of the corner rises along a direction of its frame.
bool leaves(const Corner& corner, const Vector3& direction) {
  const Vector3& p = corner.mesh->vertices()[std::size_t(corner.feature.vertices[0])];
  bool is_clear = true;
  for_each_face(corner, [&](const Triangle& face) {
    for (const Vector3& vertex : face) {
      const Vector3 ray = vertex - p;
      is_clear = is_clear && direction.dot(ray) <= kLeavingSine * ray.norm();
    }
  });
  return is_clear;
}

// How far a point is above the highest of the corner's faces, `apart` from it in its frame. The outer
// side of an open surface is the one on which the bodies began.
Scalar height_above_faces(const Corner& corner, const Vector3& apart, const Vector3& first) {
  Scalar height = -kInfinity;
  for_each_face(corner, [&](const Triangle& face) {
    const Vector3 normal = (face[1] - face[0]).cross(face[2] - face[0]);
    const Scalar length = normal.norm();
    if (!(length > 0)) return;
    const bool is_turned = !corner.mesh->is_closed() && normal.dot(first) < 0;
    height = std::max(height, (is_turned ? -1 : 1) * normal.dot(apart) / length);
  });
  return height;
}

// Direction of an edge in its shape's frame; zero for a vertex.
Vector3 edge_of(const Corner& corner) {
  if (corner.feature.kind != FeatureKind::Edge) return Vector3::Zero();
  const auto vertices = corner.mesh->vertices();
  return (vertices[std::size_t(corner.feature.vertices[1])] -
          vertices[std::size_t(corner.feature.vertices[0])])
      .normalized();
}

// Not the core of a ball or of a capsule.
bool has_faces(const Corner& corner) {
  bool has = false;
  for_each_face(corner, [&](const Triangle&) { has = true; });
  return has;
}

/// Two corners that move straight on, the vector from A's to B's across their edges.
struct CornerWay {
  Corner a;
  Corner b;
  Vector3 first = Vector3::Zero();
  Vector3 nearest = Vector3::Zero();
  Vector3 last = Vector3::Zero();

  Scalar gap(Scalar separation) const { return separation - a.radius - b.radius; }
};

std::optional<CornerWay> corner_way(const ContactPoint& point,
                                    const contact_internal::MovedPieces& pieces) {
  const auto a = corner_of(pieces.a, point.feature_a);
  const auto b = corner_of(pieces.b, point.feature_b);
  if (!a || !b) return std::nullopt;
  const Vector3 edge_a_W = pieces.X_WA_end.rotation() * edge_of(*a);
  const Vector3 edge_b_W = pieces.X_WB_end.rotation() * edge_of(*b);
  const Vector3& along_W = edge_a_W.isZero(0) ? edge_b_W : edge_a_W;
  const auto across = [&](const Vector3& x) { return Vector3(x - along_W * along_W.dot(x)); };
  const Vector3& n = point.nhat_AB_W;
  const Vector3 core_a = point.p_ACa - a->radius * (pieces.X_WA.rotation().transpose() * n);
  const Vector3 core_b = point.p_BCb + b->radius * (pieces.X_WB.rotation().transpose() * n);
  CornerWay way{*a, *b};
  way.first = across(pieces.X_WB * core_b - pieces.X_WA * core_a);
  way.last = across(pieces.X_WB_end * core_b - pieces.X_WA_end * core_a);
  const Vector3 step = way.last - way.first;
  const Scalar length_sq = step.squaredNorm();
  const Scalar s = length_sq > 0 ? -way.first.dot(step) / length_sq : 0;
  way.nearest = way.first + std::clamp(s, Scalar{0}, Scalar{1}) * step;
  return way;
}

}  // namespace

std::optional<Scalar> least_corner_gap(const ContactPoint& point,
                                       const contact_internal::MovedPieces& pieces) {
  const auto way = corner_way(point, pieces);
  if (!way || (!has_faces(way->a) && !has_faces(way->b))) return std::nullopt;
  return way->gap(way->nearest.norm());
}

std::optional<Scalar> passing_gap(const ContactPoint& point,
                                  const contact_internal::MovedPieces& pieces) {
  const auto way = corner_way(point, pieces);
  if (!way) return std::nullopt;
  const Scalar lengths = way->first.norm() * way->last.norm();
  if (!(way->first.dot(way->last) < kPassingCosine * lengths)) return std::nullopt;
  const Matrix3 R_AW = pieces.X_WA_end.rotation().transpose();
  const Matrix3 R_BW = pieces.X_WB_end.rotation().transpose();
  const auto separation = [&](const Vector3& apart) {
    const Vector3 from_a = R_AW * apart;
    const Vector3 from_b = R_BW * -apart;
    if (leaves(way->a, from_a.normalized()) && leaves(way->b, from_b.normalized())) {
      return apart.norm();
    }
    return std::max(height_above_faces(way->a, from_a, R_AW * way->first),
                    height_above_faces(way->b, from_b, R_BW * -way->first));
  };
  const Scalar gap = way->gap(std::min(separation(way->nearest), separation(way->last)));
  return gap > 0 ? std::optional(gap) : std::nullopt;
}

namespace {

// The least distance of two convex shapes on a straight way that ends in `last`, which is a convex
// function of the way, within a few halvings of the part that holds it.
Scalar least_on_way(const contact_internal::MovedPieces& pieces, const DistanceResult& last) {
  constexpr int kHalvings = 5;
  const Vector3 way_a = pieces.X_WA_end.translation() - pieces.X_WA.translation();
  const Vector3 way_b = pieces.X_WB_end.translation() - pieces.X_WB.translation();
  const auto is_leaving = [&](const DistanceResult& at) {
    return (at.p_WCb - at.p_WCa).dot(way_b - way_a) > 0;
  };
  Scalar least = last.upper;
  if (!is_leaving(last)) return least;
  Scalar before = 0;
  Scalar after = 1;
  for (int k = 0; k < kHalvings; ++k) {
    const Scalar s = (before + after) / 2;
    const RigidPose X_WA = RigidPose::from_trusted(pieces.X_WA_end.rotation(),
                                                   pieces.X_WA_end.translation() - (1 - s) * way_a);
    const RigidPose X_WB = RigidPose::from_trusted(pieces.X_WB_end.rotation(),
                                                   pieces.X_WB_end.translation() - (1 - s) * way_b);
    const DistanceResult at = distance(pieces.a, X_WA, pieces.b, X_WB);
    least = std::min(least, at.upper);
    (is_leaving(at) ? after : before) = s;
  }
  return least;
}

// Meshes of more triangles are not asked for their distance by each contact.
constexpr std::size_t kSmallMesh = 500;

bool has_few_corners(const Shape& shape) {
  if (shape.kind() != ShapeKind::TriangleMesh) return true;
  return static_cast<const TriangleMesh&>(shape).triangles().size() <= kSmallMesh;
}

// The least gap of two corners that pass each other, if no other corners of their shapes come
// nearer: else theirs. None for large meshes, of which other corners mostly do.
std::optional<Scalar> least_passing_gap(const ContactPoint& point,
                                        const contact_internal::MovedPieces& pieces) {
  if (!has_few_corners(pieces.a) || !has_few_corners(pieces.b)) return std::nullopt;
  const std::optional<Scalar> passed = passing_gap(point, pieces);
  if (!passed) return std::nullopt;
  const DistanceResult last = distance(pieces.a, pieces.X_WA_end, pieces.b, pieces.X_WB_end);
  return last.lower > 0 ? std::min(*passed, least_on_way(pieces, last)) : Scalar{0};
}

// Two convex shapes, one of them smooth: their one contact slides over the surfaces, and a distance
// query finds it. If its normal turns far, the shapes pass each other.
std::optional<EndGap> smooth_end_gap(const ContactPoint& point,
                                     const contact_internal::MovedPieces& pieces) {
  const DistanceResult last = distance(pieces.a, pieces.X_WA_end, pieces.b, pieces.X_WB_end);
  if (!(last.lower > 0)) return std::nullopt;
  EndGap end{last.upper, between(last.p_WCa, last.p_WCb)};
  const Vector3 apart = last.p_WCb - last.p_WCa;
  if (apart.dot(point.nhat_AB_W) < kPassingCosine * apart.norm()) {
    end.gap = least_on_way(pieces, last);
    end.passes = end.gap > 0;
  }
  return end;
}

// A contact of a smooth shape on a mesh is looked at for a passage, a query of the whole mesh, if it
// would close to less than this part of its gap.
constexpr Scalar kPassingPart = 0.5;

// The end gap of a place on flat parts of curved surfaces. The place is where the point on the
// border is; the normal belongs to the other side.
EndGap flat_end_gap(const ContactPoint& point, const contact_internal::MovedPieces& pieces) {
  const contact_internal::FlatEnd end = contact_internal::flat_end(point, pieces);
  const Scalar gap = end.nhat_AB_W.dot(end.p_WCb - end.p_WCa);
  const Vector3 half = gap / 2 * end.nhat_AB_W;
  return {gap, point.normal_is_of_b ? Vector3(end.p_WCa + half) : Vector3(end.p_WCb - half)};
}

}  // namespace

bool is_on_face(const ContactPoint& point) {
  return point.feature_a.kind == FeatureKind::Face || point.feature_b.kind == FeatureKind::Face;
}

EndGap end_gap(const ContactPoint& point, const BodyRecord& a, const RigidPose& X_WA,
               const RigidPose& X_WA_end, const BodyRecord& b, const RigidPose& X_WB,
               const RigidPose& X_WB_end) {
  const Shape& shape_a = shape_part(*a.definition.shape, point.key.a.piece);
  const Shape& shape_b = shape_part(*b.definition.shape, point.key.b.piece);
  const contact_internal::MovedPieces pieces{shape_a, shape_b, X_WA, X_WB, X_WA_end, X_WB_end};
  if (contact_internal::is_flat_contact(point)) return flat_end_gap(point, pieces);
  const bool has_smooth = is_smooth_core(shape_a) || is_smooth_core(shape_b);
  if (has_smooth && !is_mesh(shape_a) && !is_mesh(shape_b)) {
    if (const auto smooth = smooth_end_gap(point, pieces)) return *smooth;
  } else if (auto rounded = rounded_end_gap(point, shape_a, X_WA_end, shape_b, X_WB_end)) {
    rounded->least = least_corner_gap(point, pieces);
    return *rounded;
  } else if (const auto crossing =
                 crossing_end_gap(point, shape_a, X_WA, X_WA_end, shape_b, X_WB, X_WB_end)) {
    return *crossing;
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
    end.may_overstate =
        point.feature_a.kind == FeatureKind::Edge && point.feature_b.kind == FeatureKind::Edge;
  }
  if (const auto passed = least_passing_gap(point, pieces)) {
    end.gap = *passed;
    end.passes = true;
    end.may_overstate = false;
  } else if (has_smooth && end.gap < kPassingPart * point.gap && !is_on_face(point)) {
    const auto smooth = smooth_end_gap(point, pieces);
    if (smooth && smooth->passes) return *smooth;
  }
  return end;
}

Scalar closing_at_dip(Scalar room, Scalar error) {
  return error > 0 && room < error ? 2 * std::sqrt(error * std::max(room, Scalar{0})) : kInfinity;
}

// Hits.

namespace {

// Cosine of the angle up to which contacts face the same way as the hit.
constexpr Scalar kSameWay = 0.99;

const Shape& part_of(const BodyRecord& body, const FeatureKey& key) {
  return shape_part(*body.definition.shape, key.piece);
}

// The arm of a contact on a smooth body, from R_hit to R. Turning about the normal takes the point
// along, and tilting lifts it; what rolls does not take it along.
Vector3 carried_arm(const Vector3& arm_W, const Vector3& nhat_W, const Matrix3& R_hit,
                    const Matrix3& R) {
  const Matrix3 turn = R * R_hit.transpose();
  const Vector3 along_W = arm_W - nhat_W * nhat_W.dot(arm_W);
  const Vector3 about_normal_W = nhat_W * nhat_W.dot(rotation_vector(turn));
  return rotation_from_vector(about_normal_W) * along_W +
         nhat_W * nhat_W.dot(arm_W + turn * along_W);
}

// Moves a contact at the poses of the hit back.
void carry_back(const ToiResult& hit, const HitPair& pair, ContactPoint& point) {
  const Vector3 nhat_hit = point.nhat_AB_W;
  const RigidPose& X_WS = point.normal_is_of_b ? pair.X_WB : pair.X_WA;
  point.nhat_AB_W = (X_WS.rotation() * point.nhat_AB_S).normalized();
  const auto carried = [&](const Vector3& p_W, const BodyRecord& body, const FeatureKey& key,
                           Scalar sign, const RigidPose& X_hit, const RigidPose& X_W) -> Vector3 {
    const Shape& part = part_of(body, key);
    if (is_smooth_core(part)) {
      const Vector3& center = body.definition.mass_properties.p_BoBcm;
      return X_W * center +
             carried_arm(p_W - X_hit * center, nhat_hit, X_hit.rotation(), X_W.rotation());
    }
    const Scalar radius = sign * rounding_radius(part);
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

// All contacts beside a hit are looked for between so many parts of compounds at most.
constexpr std::size_t kFewParts = 16;

bool has_few_convex_parts(const Shape& shape) {
  if (shape.kind() != ShapeKind::Compound) return shape.kind() == ShapeKind::Convex;
  const auto& parts = static_cast<const CompoundShape&>(shape).tree().parts;
  return parts.size() <= kFewParts &&
         std::all_of(parts.begin(), parts.end(), [](const geometry_internal::CompoundPart& part) {
           return part.convex != nullptr;
         });
}

}  // namespace

std::vector<ContactPoint> contacts_of_hit(const ToiResult& hit, const HitPair& pair, Scalar reach,
                                          ContactWorkspace& workspace) {
  std::vector<ContactPoint> points{point_of_hit(hit)};
  const Shape& a = *pair.a.definition.shape;
  const Shape& b = *pair.b.definition.shape;
  if (has_few_convex_parts(a) && has_few_convex_parts(b)) {
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

Vector3 acting_point(const ContactPoint& hit, const ContactBody& body_a,
                     const ContactBody& body_b) {
  const Vector3 half = hit.gap / 2 * hit.nhat_AB_W;
  const FeatureKind a = hit.feature_a.kind;
  const FeatureKind b = hit.feature_b.kind;
  const bool is_of_a = b == FeatureKind::Face || (a == FeatureKind::Vertex && !is_on_face(hit));
  const bool is_of_b = a == FeatureKind::Face || (b == FeatureKind::Vertex && !is_on_face(hit));
  if (is_of_a != is_of_b) return is_of_a ? Vector3(hit.p_WCa + half) : Vector3(hit.p_WCb - half);
  // Neither: closer to the point of the body that an offset would spin more.
  const Vector3 lever_W = (hit.p_WCb - hit.p_WCa).cross(hit.nhat_AB_W);
  const Scalar turn_a = lever_W.dot(body_a.inverse_inertia_W * lever_W);
  const Scalar turn_b = lever_W.dot(body_b.inverse_inertia_W * lever_W);
  const Scalar sum = turn_a + turn_b;
  const Scalar share = sum > 0 ? turn_b / sum : 0.5;
  return (1 - share) * (hit.p_WCa + half) + share * (hit.p_WCb - half);
}

// Contacts on curved surfaces.

namespace {

// Where the end of a contact is looked for.
struct EndSearch {
  ContactPlace place;
  Scalar near = 0;  // how far from the place
};

std::optional<EndSearch> end_search(const ContactPoint& point, const CurvedMove& move,
                                    const PairLengths& lengths, const RigidPose& X_WA_end,
                                    const RigidPose& X_WB_end) {
  const Scalar travel = move.sliding + move.rolling * lengths.radius;
  if (!(travel > kContactMergedChange * lengths.rest_offset)) return std::nullopt;
  EndSearch search;
  ContactPlace& place = search.place;
  // How far the surfaces beside the contact may come below it.
  const Scalar sagitta = std::max(travel * travel / lengths.radius, move.turn * point.merged_way);
  place.nhat_AB_W = point.nhat_AB_W;
  place.lift = std::max(0.0, sagitta - move.end_gap);
  place.reach =
      std::max(move.end_gap, lengths.rest_gap()) + lengths.rest_offset + sagitta + place.lift;
  // A rim that leans moves its contact along itself much faster than any of its points.
  const Scalar migration =
      point.merged_way > 0 ? kContactMergedRadiusFraction * lengths.radius : Scalar{0};
  search.near = std::max(kContactMeasuredWays * travel, migration);
  place.p_WCa = X_WA_end * point.p_ACa;
  place.p_WCb = X_WB_end * point.p_BCb;
  place.region = {(place.p_WCa + place.p_WCb) / 2,
                  search.near + (place.p_WCa - place.p_WCb).norm() / 2};
  return search;
}

// Contacts found at the end of a substep, and how far each is from the nearest contact of the pair.
class FoundEnds {
 public:
  FoundEnds(std::span<const ContactPoint> found, std::span<const Vector3> points_W)
      : found_(found), points_W_(points_W), nearest_sq_(found.size(), -1) {}

  std::span<const ContactPoint> contacts() const { return found_; }
  // Computed when first asked for.
  Scalar nearest_sq(std::size_t k) {
    Scalar& least = nearest_sq_[k];
    if (least >= 0) return least;
    least = kInfinity;
    for (const Vector3& p_W : points_W_) {
      least = std::min(least, (found_[k].p_WCa - p_W).squaredNorm());
    }
    return least;
  }

 private:
  std::span<const ContactPoint> found_;
  std::span<const Vector3> points_W_;
  std::vector<Scalar> nearest_sq_;
};

// The end of a contact among those found at its place. What is nearer to another point of the pair
// belongs to that one.
std::optional<EndGap> end_among(FoundEnds& found, const ContactPoint& point,
                                const EndSearch& search, Scalar most_sagitta) {
  const ContactPlace& place = search.place;
  std::vector<const ContactPoint*> near_by;
  const ContactPoint* nearest = nullptr;
  const auto gap_of = [&](const ContactPoint& other) {
    return other.gap - place.lift * other.nhat_AB_W.dot(place.nhat_AB_W);
  };
  for (std::size_t k = 0; k < found.contacts().size(); ++k) {
    const ContactPoint& other = found.contacts()[k];
    const Scalar cosine = other.nhat_AB_W.dot(place.nhat_AB_W);
    const Scalar apart = std::min((other.p_WCa - place.p_WCa).squaredNorm(),
                                  (other.p_WCa - place.p_WCb).squaredNorm());
    if (cosine < kContactMergedCosine || apart > search.near * search.near) continue;
    if (found.nearest_sq(k) < apart) continue;
    near_by.push_back(&other);
    if (!nearest || gap_of(other) < gap_of(*nearest)) nearest = &other;
  }
  if (!nearest) return std::nullopt;
  std::optional<ContactPoint> fitted;
  if (point.merged_way > 0) {
    fitted = fitted_contact(*nearest, near_by, most_sagitta);
  }
  const ContactPoint& found_at = fitted ? *fitted : *nearest;
  const Vector3 lift_W = place.lift * place.nhat_AB_W;
  EndGap end{gap_of(found_at), Vector3((found_at.p_WCa + found_at.p_WCb - lift_W) / 2)};
  end.is_smooth = fitted.has_value();
  return end;
}

// The most pieces of a pair that are looked at for ends so far away that a shorter substep would
// need fewer. Larger: an attempt that is given up takes longer, some microseconds a piece; smaller:
// shorter substeps where fine meshes roll on each other. Found by measurement.
constexpr int kMostFarPieces = 20000;
// Ends are far if they are sought so many times farther than those of bodies at rest.
constexpr Scalar kFarReach = 4;
// Pieces between two looks at the clock.
constexpr int kPiecesBetweenClocks = 64;

// Ends a search for ends at the deadline, or after too many pieces if these are far.
class EndSearchLimit final : public Interrupt {
 public:
  EndSearchLimit(const QueryLimits& limits, bool is_far) : limits_(limits), is_far_(is_far) {}

  bool is_over() override {
    ++pieces_;
    if (is_far_ && pieces_ > kMostFarPieces) is_over_ = true;
    if (pieces_ % kPiecesBetweenClocks == 0 && limits_.exceeded()) is_over_ = true;
    return is_over_;
  }

 private:
  const QueryLimits& limits_;
  bool is_far_;
  int pieces_ = 0;
  bool is_over_ = false;
};

// From here on one pass over the whole pair costs less than a search for each contact.
constexpr std::size_t kSharedEnds = 2;
// The same for a round body on a mesh.
constexpr std::size_t kSharedRoundEnds = 8;

using Searches = std::vector<std::optional<EndSearch>>;
using MeasuredEnds = std::vector<std::optional<EndGap>>;

// One search for the ends of many contacts of a round body on a mesh, whose surfaces need not be lifted
// apart.
struct SharedSearch {
  bool is_used = false;
  bool is_fitted = false;
  std::vector<ContactPoint> found;
};

// None if it was cut off. Nothing need be lifted if the bodies are apart at the end.
std::optional<SharedSearch> shared_search(const PairAtEnd& pair, Searches& searches,
                                          Scalar most_sagitta, Interrupt& interrupt,
                                          ContactWorkspace& workspace) {
  SharedSearch shared;
  if (searches.size() < kSharedRoundEnds) return shared;
  const bool has_lift = std::any_of(searches.begin(), searches.end(), [](const auto& search) {
    return search && search->place.lift > 0;
  });
  const bool are_apart = has_lift && distance(pair.a, pair.X_WA, pair.b, pair.X_WB).lower > 0;
  Scalar reach = 0;
  for (auto& search : searches) {
    if (!search) continue;
    if (are_apart) search->place.lift = 0;
    if (search->place.lift > 0) continue;
    shared.is_used = true;
    reach = std::max(reach, search->place.reach);
  }
  if (!shared.is_used) return shared;
  if (!generate_contacts(pair.a, pair.X_WA, pair.b, pair.X_WB, reach, {}, workspace, shared.found,
                         &interrupt)) {
    return std::nullopt;
  }
  shared.is_fitted =
      fit_ball_contacts(pair.a, pair.X_WA, pair.b, pair.X_WB, most_sagitta, shared.found);
  return shared;
}

// The searches lose lifts that they do not need.
std::optional<MeasuredEnds> ends_alone(const PairAtEnd& pair,
                                       std::span<const CurvedContact> contacts, Searches& searches,
                                       Interrupt& interrupt, ContactWorkspace& workspace) {
  const Scalar most_sagitta = kContactFitRestOffsets * pair.lengths.rest_offset;
  MeasuredEnds ends(contacts.size());
  const auto shared = shared_search(pair, searches, most_sagitta, interrupt, workspace);
  if (!shared) return std::nullopt;
  std::vector<ContactPoint> found;
  FoundEnds found_together(shared->found, pair.points_W);
  const auto take_end = [&](FoundEnds& among, bool is_fitted, std::size_t k) {
    ends[k] = end_among(among, *contacts[k].point, *searches[k], most_sagitta);
    if (ends[k] && is_fitted) ends[k]->is_smooth = true;
  };
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    if (!searches[k]) continue;
    const ContactPlace& place = searches[k]->place;
    if (shared->is_used && !(place.lift > 0)) {
      take_end(found_together, shared->is_fitted, k);
      continue;
    }
    const RigidPose X_WB = lifted(place, pair.X_WB);
    ContactGeneratorOptions options;
    options.region = place.region;
    if (!generate_contacts(pair.a, pair.X_WA, pair.b, X_WB, place.reach, options, workspace, found,
                           &interrupt)) {
      return std::nullopt;
    }
    const bool is_fitted = fit_ball_contacts(pair.a, pair.X_WA, pair.b, X_WB, most_sagitta, found);
    FoundEnds found_here(found, pair.points_W);
    take_end(found_here, is_fitted, k);
  }
  return ends;
}

std::optional<MeasuredEnds> ends_together(const PairAtEnd& pair,
                                          std::span<const CurvedContact> contacts,
                                          const Searches& searches, Interrupt& interrupt,
                                          ContactWorkspace& workspace) {
  const Scalar most_sagitta = kContactFitRestOffsets * pair.lengths.rest_offset;
  MeasuredEnds ends(contacts.size());
  std::vector<ContactPlace> places;
  std::vector<std::size_t> numbers;
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    if (!searches[k]) continue;
    places.push_back(searches[k]->place);
    numbers.push_back(k);
  }
  const bool is_complete = generate_placed_contacts(
      {pair.a, pair.X_WA, pair.b, pair.X_WB, places, pair.points_W, &interrupt}, workspace,
      [&](std::size_t place, const std::vector<ContactPoint>& found) {
        const std::size_t k = numbers[place];
        FoundEnds found_here(found, pair.points_W);
        ends[k] = end_among(found_here, *contacts[k].point, *searches[k], most_sagitta);
      });
  if (!is_complete) return std::nullopt;
  return ends;
}

}  // namespace

bool is_on_curved_surface(const ContactPoint& point, const BodyRecord& a, const BodyRecord& b) {
  if (point.merged_way > 0) return true;
  const Shape& shape_a = shape_part(*a.definition.shape, point.key.a.piece);
  const Shape& shape_b = shape_part(*b.definition.shape, point.key.b.piece);
  const auto is_round = [](const Shape& shape) {
    return rounding_radius(shape) > 0 || is_smooth_core(shape);
  };
  return (is_round(shape_a) && is_mesh(shape_b)) || (is_round(shape_b) && is_mesh(shape_a));
}

std::optional<MeasuredEnds> measured_end_gaps(const PairAtEnd& pair,
                                              std::span<const CurvedContact> contacts,
                                              NeighbourList& neighbours, const QueryLimits& limits,
                                              ContactWorkspace& workspace) {
  Searches searches;
  std::size_t count = 0;
  Scalar reach = 0;
  for (const CurvedContact& contact : contacts) {
    searches.push_back(
        end_search(*contact.point, contact.move, pair.lengths, pair.X_WA, pair.X_WB));
    if (!searches.back()) continue;
    ++count;
    reach = std::max(reach, searches.back()->place.reach);
  }
  const ScopedUse use(workspace.impl().neighbours, neighbours);
  EndSearchLimit limit(limits,
                       reach > kFarReach * (pair.lengths.rest_gap() + pair.lengths.rest_offset));
  const bool are_meshes =
      pair.a.kind() == ShapeKind::TriangleMesh && pair.b.kind() == ShapeKind::TriangleMesh;
  return are_meshes && count >= kSharedEnds
             ? ends_together(pair, contacts, searches, limit, workspace)
             : ends_alone(pair, contacts, searches, limit, workspace);
}

}  // namespace dyop::dynamics_internal
