// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/shape.h"

#include <algorithm>
#include <cmath>
#include <ostream>
#include <utility>
#include <vector>

#include "dyop/core/error.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop {

std::string_view name_of(FeatureKind kind) {
  switch (kind) {
    case FeatureKind::Vertex:
      return "Vertex";
    case FeatureKind::Edge:
      return "Edge";
    case FeatureKind::Face:
      return "Face";
    case FeatureKind::Smooth:
      return "Smooth";
  }
  return "Smooth";
}

std::ostream& operator<<(std::ostream& out, FeatureKind kind) {
  return out << name_of(kind);
}

Scalar Shape::size() const {
  return std::min(bounding_radius(), bounding_box().diagonal().norm() / 2);
}

MassProperties with_mass(const MassProperties& properties, Scalar mass) {
  DYOP_REQUIRE(std::isnormal(mass) && mass > 0, "mass must be > 0 and in the range of double, not ",
               mass);
  DYOP_REQUIRE(std::isfinite(properties.mass) && properties.mass > 0,
               "the mass to scale must be finite and > 0, not ", properties.mass);
  return {mass, properties.p_BoBcm, properties.I_BBcm * (mass / properties.mass)};
}

// Scaling.

namespace {

using ShapePointer = std::shared_ptr<const Shape>;

// Points p become map p + shift. A shape that is mirrored keeps its orientation where it has one.
struct AffineMap {
  Matrix3 map;
  Vector3 shift = Vector3::Zero();

  Vector3 operator()(const Vector3& p) const { return map * p + shift; }
};

// Relative; larger than the rounding of a product of rotations. Smaller: a child that is turned by a
// right angle does not count as such.
constexpr Scalar kTurnNoise = 1e-13;  // literal: some hundred roundings

bool have_equal_sizes(Scalar x, Scalar y) {
  return std::abs(std::abs(x) - std::abs(y)) <= kTurnNoise * std::abs(x);
}

bool has_equal_sizes(const Vector3& x) {
  return have_equal_sizes(x.x(), x.y()) && have_equal_sizes(x.x(), x.z());
}

bool is_diagonal(const Matrix3& map) {
  const Vector3 diagonal = map.diagonal();
  const Matrix3 rest = map - Matrix3(diagonal.asDiagonal());
  return rest.cwiseAbs().maxCoeff() <= kTurnNoise * diagonal.cwiseAbs().minCoeff();
}

ShapePointer mapped_mesh(const TriangleMesh& mesh, const AffineMap& map) {
  std::vector<Vector3> vertices;
  for (const Vector3& p : mesh.vertices()) vertices.push_back(map(p));
  std::vector<TriangleIndices> triangles(mesh.triangles().begin(), mesh.triangles().end());
  if (map.map.determinant() < 0) {
    for (TriangleIndices& triangle : triangles) std::swap(triangle[1], triangle[2]);
  }
  return std::make_shared<TriangleMesh>(std::move(vertices), std::move(triangles));
}

ShapePointer mapped_hull(std::span<const Vector3> points, const AffineMap& map, Scalar radius = 0) {
  std::vector<Vector3> mapped;
  for (const Vector3& p : points) mapped.push_back(map(p));
  return std::make_shared<ConvexHull>(std::move(mapped), radius);
}

std::vector<Vector3> corners(const Vector3& half_extents) {
  std::vector<Vector3> points;
  for (int k = 0; k < 8; ++k) {
    const Vector3 signs((k & 1) != 0 ? 1 : -1, (k & 2) != 0 ? 1 : -1, (k & 4) != 0 ? 1 : -1);
    points.push_back(half_extents.cwiseProduct(signs));
  }
  return points;
}

// Shapes that are symmetric about the planes of their axes, or about those that hold the z axis: by
// positive factors. Null for others, and for factors that a shape does not take.
ShapePointer scaled_primitive(const Shape& shape, const Vector3& f) {
  const bool is_uniform = has_equal_sizes(f);
  const bool is_round = have_equal_sizes(f.x(), f.y());
  if (const auto* ball = dynamic_cast<const Sphere*>(&shape)) {
    if (is_uniform) return std::make_shared<Sphere>(f.x() * ball->radius());
    return std::make_shared<Ellipsoid>(Vector3(f * ball->radius()));
  }
  if (const auto* ellipsoid = dynamic_cast<const Ellipsoid*>(&shape)) {
    return std::make_shared<Ellipsoid>(Vector3(f.cwiseProduct(ellipsoid->semi_axes())));
  }
  if (const auto* box = dynamic_cast<const Box*>(&shape)) {
    return std::make_shared<Box>(Vector3(f.cwiseProduct(box->half_extents())));
  }
  if (const auto* cylinder = dynamic_cast<const Cylinder*>(&shape); cylinder && is_round) {
    return std::make_shared<Cylinder>(f.x() * cylinder->radius(), f.z() * cylinder->half_length());
  }
  if (const auto* cone = dynamic_cast<const Cone*>(&shape); cone && is_round) {
    return std::make_shared<Cone>(f.x() * cone->radius(), f.z() * cone->half_length());
  }
  if (!is_uniform) return nullptr;
  if (const auto* box = dynamic_cast<const RoundedBox*>(&shape)) {
    return std::make_shared<RoundedBox>(Vector3(f.x() * box->half_extents()),
                                        f.x() * box->radius());
  }
  if (const auto* capsule = dynamic_cast<const Capsule*>(&shape)) {
    return std::make_shared<Capsule>(f.x() * capsule->radius(), f.x() * capsule->half_length());
  }
  if (const auto* cylinder = dynamic_cast<const RoundedCylinder*>(&shape)) {
    return std::make_shared<RoundedCylinder>(f.x() * cylinder->radius(),
                                             f.x() * cylinder->half_length(),
                                             f.x() * cylinder->edge_radius());
  }
  if (const auto* capsule = dynamic_cast<const TaperedCapsule*>(&shape)) {
    return std::make_shared<TaperedCapsule>(f.x() * capsule->bottom_radius(),
                                            f.x() * capsule->top_radius(),
                                            f.x() * capsule->half_length());
  }
  return nullptr;
}

bool is_upright(const Shape& shape) {
  return dynamic_cast<const Cone*>(&shape) || dynamic_cast<const TaperedCapsule*>(&shape);
}

// A shape in its frame, and that frame after the map. All of them but meshes and hulls are symmetric
// about x = 0, so a map that mirrors is a turn for them.
CompoundChild mapped_child(const Shape& shape, const RigidPose& X_CS, const Vector3& factors) {
  const AffineMap map{factors.asDiagonal() * X_CS.rotation(),
                      factors.cwiseProduct(X_CS.translation())};
  if (const auto* mesh = dynamic_cast<const TriangleMesh*>(&shape)) {
    return {mapped_mesh(*mesh, map), RigidPose()};
  }
  const auto* hull = dynamic_cast<const ConvexHull*>(&shape);
  if (hull && (hull->rounding_radius() == 0 || has_equal_sizes(factors))) {
    const Scalar radius = hull->rounding_radius() * std::abs(factors.x());
    return {mapped_hull(hull->vertices(), map, radius), RigidPose()};
  }
  const Vector3 sizes = factors.cwiseAbs();
  const Matrix3 signs = factors.cwiseSign().asDiagonal();
  if (has_equal_sizes(factors)) {
    Matrix3 R = signs * X_CS.rotation();
    if (R.determinant() < 0) R.col(0) = -R.col(0);
    return {scaled_primitive(shape, sizes), RigidPose(R, map.shift)};
  }
  const Matrix3 stretch = X_CS.rotation().transpose() * sizes.asDiagonal() * X_CS.rotation();
  if (is_diagonal(stretch)) {
    Matrix3 R = signs * X_CS.rotation();
    if (R.determinant() < 0) R.col(0) = -R.col(0);
    return {scaled_primitive(shape, stretch.diagonal()), RigidPose(R, map.shift)};
  }
  if (dynamic_cast<const Sphere*>(&shape)) {
    return {scaled_primitive(shape, sizes), RigidPose(map.shift)};
  }
  if (const auto* box = dynamic_cast<const Box*>(&shape)) {
    return {mapped_hull(corners(box->half_extents()), map), RigidPose()};
  }
  return {};
}

}  // namespace

ShapePointer scaled(const Shape& shape, const Vector3& factors) {
  DYOP_REQUIRE(factors.allFinite() && (factors.array() != 0).all(),
               "scale factors must be finite and not zero, not (", factors.transpose(), ")");
  if (const HalfSpace* const half_space = as_half_space(shape)) {
    const Vector3 normal = half_space->normal().cwiseQuotient(factors);
    return std::make_shared<HalfSpace>(normal, half_space->offset() / normal.norm());
  }
  if (const auto* compound = dynamic_cast<const CompoundShape*>(&shape)) {
    std::vector<CompoundChild> children;
    for (const CompoundChild& child : compound->children()) {
      children.push_back(mapped_child(*child.shape, child.X_CS, factors));
      DYOP_REQUIRE(children.back().shape, "child ", children.size() - 1,
                   " of the compound cannot be scaled by (", factors.transpose(),
                   "): its shape does not allow these factors as it is turned");
    }
    return std::make_shared<CompoundShape>(children);
  }
  const CompoundChild child = mapped_child(shape, RigidPose(), factors);
  DYOP_REQUIRE(child.shape || mapped_child(shape, RigidPose(), Vector3::Ones()).shape,
               "the shape cannot be scaled: it is of a class of your own");
  DYOP_REQUIRE(child.shape, "the shape cannot be scaled by (", factors.transpose(),
               "): only factors of one size keep what is rounded, and of one size along x and y "
               "what is round");
  const bool is_turned = is_upright(shape) && factors.z() < 0;
  return is_turned ? std::make_shared<CompoundShape>(std::vector{child}) : child.shape;
}

}  // namespace dyop
