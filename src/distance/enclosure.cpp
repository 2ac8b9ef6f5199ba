#include "distance/enclosure.h"

#include "dyop/core/error.h"
#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/winding_number.h"

namespace dyop::internal {
namespace {

const TriangleMesh* as_mesh(const Shape& shape) {
  return shape.kind() == ShapeKind::TriangleMesh ? static_cast<const TriangleMesh*>(&shape)
                                                 : nullptr;
}

// Each connected part is on one side as a whole.
std::optional<Vector3> find_inside(const TriangleMesh& solid, const RigidPose& X_WS,
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

}  // namespace

void require_closed(const char* query, const Shape& a, const Shape& b, const Solids& solids) {
  const auto is_sound = [](const Shape& shape) {
    const TriangleMesh* mesh = as_mesh(shape);
    return !mesh || mesh->is_closed();
  };
  DYOP_REQUIRE(!solids.a || is_sound(a), query, ": solid_a is set, but the mesh A is not closed");
  DYOP_REQUIRE(!solids.b || is_sound(b), query, ": solid_b is set, but the mesh B is not closed");
}

std::optional<Vector3> find_enclosed_point(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                           const RigidPose& X_WB, const Solids& solids) {
  const TriangleMesh* mesh_a = solids.a ? as_mesh(a) : nullptr;
  const TriangleMesh* mesh_b = solids.b ? as_mesh(b) : nullptr;
  if (mesh_b) {
    if (const auto p_W = find_inside(*mesh_b, X_WB, a, X_WA)) return p_W;
  }
  if (mesh_a) return find_inside(*mesh_a, X_WA, b, X_WB);
  return std::nullopt;
}

}  // namespace dyop::internal
