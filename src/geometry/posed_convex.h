// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>

#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop::geometry_internal {

/// A convex shape S in another frame C, with the vertex numbers of S.
class PosedConvex final : public ConvexShape {
 public:
  PosedConvex(std::shared_ptr<const ConvexShape> shape, const RigidPose& X_CS);

  SupportPoint core_support(const Vector3& direction) const override {
    const SupportPoint support = shape_->core_support(X_CS_.rotation().transpose() * direction);
    return {X_CS_ * support.point, support.vertex};
  }
  Scalar core_reach(const Vector3& direction) const override {
    return shape_->core_reach(X_CS_.rotation().transpose() * direction) +
           direction.dot(X_CS_.translation());
  }
  Scalar rounding_radius() const override { return shape_->rounding_radius(); }
  Vector3 core_center() const override { return X_CS_ * shape_->core_center(); }
  const TriangleMesh* core_surface() const override { return surface_ ? &*surface_ : nullptr; }
  AlignedBox bounding_box() const override;
  Scalar bounding_radius() const override;
  MassProperties compute_mass_properties(Scalar density) const override;

  /// The shape's own bounding box, rotated with it.
  OrientedBox box() const;

 private:
  std::shared_ptr<const ConvexShape> shape_;
  RigidPose X_CS_;
  std::optional<TriangleMesh> surface_;
};

/// The same mass in another frame: X_CS is the pose of the frame S it is given in.
MassProperties posed(const MassProperties& properties, const RigidPose& X_CS);

/// The vertices of a mesh at a pose.
std::vector<Vector3> posed_vertices(const TriangleMesh& mesh, const RigidPose& X_CS);

}  // namespace dyop::geometry_internal
