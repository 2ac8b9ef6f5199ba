// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/triangle_mesh.h"
#include "geometry/solid.h"

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
  const TriangleMesh* core_surface() const override;
  FlatPart flat_part(const Vector3& unit_direction, Scalar sine) const override;
  AlignedBox bounding_box() const override;
  Scalar bounding_radius() const override;
  MassProperties compute_mass_properties(Scalar density) const override;

  /// The shape's own bounding box, rotated with it.
  OrientedBox box() const;

 private:
  std::shared_ptr<const ConvexShape> shape_;
  RigidPose X_CS_;
  SurfaceOnDemand surface_;
};

/// The same mass in another frame: X_CS is the pose of the frame S it is given in.
MassProperties posed(const MassProperties& properties, const RigidPose& X_CS);

/// The vertices of a mesh at a pose.
std::vector<Vector3> posed_vertices(const TriangleMesh& mesh, const RigidPose& X_CS);

/// A child of a compound in the compound's frame: a mesh or a convex shape, with its own vertex and
/// triangle numbers.
struct CompoundPart {
  std::optional<TriangleMesh> mesh;
  std::unique_ptr<const PosedConvex> convex;  // null for a mesh
  std::int32_t first_piece = 0;

  const Shape& shape() const {
    return mesh ? static_cast<const Shape&>(*mesh) : static_cast<const Shape&>(*convex);
  }
};

/// All pieces of a compound, triangles and convex shapes, under one tree in the compound's frame: a
/// small tree over the children, and below it copies of the meshes' own trees. Pieces are numbered
/// child by child.
struct CompoundTree {
  /// Children must be meshes and convex shapes.
  explicit CompoundTree(std::span<const CompoundChild> children);

  /// The number of the child that a piece belongs to.
  std::int32_t child_of(std::int32_t piece) const;
  const CompoundPart& part(std::int32_t child) const {
    return parts[static_cast<std::size_t>(child)];
  }

  /// Whether a box holds a whole child, and nothing else: no box above it does.
  bool is_part(std::int32_t box) const { return part_boxes[static_cast<std::size_t>(box)]; }
  /// The child that such a box holds.
  std::int32_t part_in(std::int32_t box) const;

  std::vector<CompoundPart> parts;
  std::vector<MeshHierarchy::Node> nodes;
  std::vector<bool> part_boxes;
  BoxFrame frame;
};

}  // namespace dyop::geometry_internal
