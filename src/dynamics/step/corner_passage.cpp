// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/corner_passage.h"

#include <algorithm>
#include <cmath>

#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop::dynamics_internal {

namespace {

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
  if (shape.kind() == ShapeKind::TriangleMesh) {
    return Corner{&static_cast<const TriangleMesh&>(shape), feature, 0};
  }
  if (shape.kind() != ShapeKind::Convex) return std::nullopt;
  const auto& convex = static_cast<const ConvexShape&>(shape);
  if (convex.core_surface() == nullptr) return std::nullopt;
  return Corner{convex.core_surface(), feature, convex.rounding_radius()};
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

}  // namespace dyop::dynamics_internal
