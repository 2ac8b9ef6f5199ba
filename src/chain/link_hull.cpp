// SPDX-License-Identifier: BSD-3-Clause
#include "chain/link_hull.h"

#include <algorithm>
#include <cmath>

#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop::chain_internal {
namespace {

void append_points(std::span<const Vector3> points, Scalar radius, const RigidPose& X_LS,
                   LinkHull& hull) {
  for (const Vector3& p : points) {
    hull.centers.push_back(X_LS * p);
    hull.radii.push_back(radius);
  }
}

void append_box(const AlignedBox& box, const RigidPose& X_LS, LinkHull& hull) {
  for (int corner = 0; corner < 8; ++corner) {
    const auto which = static_cast<AlignedBox::CornerType>(corner);
    hull.centers.push_back(X_LS * box.corner(which));
    hull.radii.push_back(0);
  }
}

void append(const Shape& shape, const RigidPose& X_LS, LinkHull& hull) {
  if (const auto* compound = dynamic_cast<const CompoundShape*>(&shape)) {
    for (const CompoundChild& child : compound->children()) {
      append(*child.shape, X_LS * child.X_CS, hull);
    }
  } else if (const auto* mesh = dynamic_cast<const TriangleMesh*>(&shape)) {
    append_points(mesh->vertices(), 0, X_LS, hull);
  } else if (const auto* convex = dynamic_cast<const ConvexShape*>(&shape);
             convex != nullptr && convex->core_surface() != nullptr) {
    append_points(convex->core_surface()->vertices(), convex->rounding_radius(), X_LS, hull);
  } else {
    append_box(shape.bounding_box(), X_LS, hull);
  }
}

}  // namespace

LinkHull link_hull(const Shape& shape) {
  LinkHull all;
  append(shape, RigidPose(), all);
  LinkHull result;
  std::vector<Vector3> sharp;
  for (std::size_t k = 0; k < all.centers.size(); ++k) {
    if (all.radii[k] == 0) {
      sharp.push_back(all.centers[k]);
    } else {
      result.centers.push_back(all.centers[k]);
      result.radii.push_back(all.radii[k]);
    }
  }
  if (!sharp.empty()) {
    const ConvexHull hull(std::move(sharp));
    append_points(hull.vertices(), 0, RigidPose(), result);
  }
  return result;
}

Scalar largest_radius(const LinkHull& hull, const RigidPose& X_CL, const Vector3& origin,
                      const Vector3& axis) {
  // In the link's frame, so that points need not be moved.
  const Matrix3 R_LC = X_CL.rotation().transpose();
  const Vector3 origin_L = R_LC * (origin - X_CL.translation());
  const Vector3 axis_L = R_LC * axis;
  Scalar largest = 0;
  for (std::size_t k = 0; k < hull.centers.size(); ++k) {
    const Vector3 arm = hull.centers[k] - origin_L;
    largest = std::max(largest, std::sqrt(axis_L.cross(arm).squaredNorm()) + hull.radii[k]);
  }
  return largest;
}

}  // namespace dyop::chain_internal
