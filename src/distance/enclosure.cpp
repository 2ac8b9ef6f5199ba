// SPDX-License-Identifier: BSD-3-Clause
#include "distance/enclosure.h"

#include <algorithm>

#include "dyop/core/error.h"
#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/triangle_mesh.h"
#include "geometry/compound_tree.h"

namespace dyop::distance_internal {
namespace {

const TriangleMesh* as_mesh(const Shape& shape) {
  return shape.kind() == ShapeKind::TriangleMesh ? static_cast<const TriangleMesh*>(&shape)
                                                 : nullptr;
}

// Calls `visit` with the meshes and convex shapes that a shape consists of, in its frame, until one
// call returns true; returns whether one did.
template <typename Visit>
bool visit_parts(const Shape& shape, const Visit& visit) {
  if (shape.kind() != ShapeKind::Compound) return visit(shape);
  const auto& parts = static_cast<const CompoundShape&>(shape).tree().parts;
  return std::any_of(parts.begin(), parts.end(),
                     [&](const CompoundPart& part) { return visit(part.shape()); });
}

// A connected part is either all inside or all outside.
std::optional<Vector3> find_inside_mesh(const TriangleMesh& solid, const RigidPose& X_WS,
                                        const Shape& shape, const RigidPose& X_WP) {
  const RigidPose X_SP = X_WS.inverse() * X_WP;
  if (const TriangleMesh* mesh = as_mesh(shape)) {
    for (const std::int32_t v : mesh->part_vertices()) {
      const Vector3& p = mesh->vertices()[std::size_t(v)];
      if (contains(solid, X_SP * p)) return X_WP * p;
    }
    return std::nullopt;
  }
  const Vector3 p = static_cast<const ConvexShape&>(shape).core_center();
  if (contains(solid, X_SP * p)) return X_WP * p;
  return std::nullopt;
}

std::optional<Vector3> find_inside(const Shape& solid, const RigidPose& X_WS, const Shape& shape,
                                   const RigidPose& X_WP) {
  std::optional<Vector3> found;
  visit_parts(solid, [&](const Shape& outer) {
    const TriangleMesh* mesh = as_mesh(outer);
    return mesh && visit_parts(shape, [&](const Shape& inner) {
             found = find_inside_mesh(*mesh, X_WS, inner, X_WP);
             return found.has_value();
           });
  });
  return found;
}

}  // namespace

void require_closed(const char* query, const Shape& a, const Shape& b, const Solids& solids) {
  const auto is_sound = [](const Shape& shape) {
    return !visit_parts(shape, [](const Shape& part) {
      const TriangleMesh* mesh = as_mesh(part);
      return mesh && !mesh->is_closed();
    });
  };
  DYOP_REQUIRE(!solids.a || is_sound(a), query, ": solid_a is set, but the mesh A is not closed");
  DYOP_REQUIRE(!solids.b || is_sound(b), query, ": solid_b is set, but the mesh B is not closed");
}

std::optional<Vector3> find_enclosed_point(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                           const RigidPose& X_WB, const Solids& solids) {
  if (solids.b) {
    if (const auto p_W = find_inside(b, X_WB, a, X_WA)) return p_W;
  }
  if (solids.a) return find_inside(a, X_WA, b, X_WB);
  return std::nullopt;
}

}  // namespace dyop::distance_internal
