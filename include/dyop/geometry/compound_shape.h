// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/shape.h"

namespace DYOP_EXPORT dyop {

namespace geometry_internal {
struct CompoundTree;
}

/// A shape of a compound, with its pose.
struct CompoundChild {
  std::shared_ptr<const Shape> shape;
  RigidPose X_CS;  ///< pose of the shape's frame S in the compound's frame C
};

/// Several shapes in one body, each at a fixed pose: meshes and convex shapes in any mix. The
/// compound is their union: queries treat a mesh child as a surface and a convex child as a solid.
/// Results name the child that was met (`child_a`, `child_b`) and give triangles and features in
/// that child's own numbers. Children may overlap.
///
/// One tree of boxes over all pieces is built once, so a query costs as much as for one mesh with
/// as many pieces. For that the vertices of mesh children are stored again in the compound's frame,
/// rounded to about 1e-15 of their size. Copies share the data.
class CompoundShape final : public Shape {
 public:
  /// A child that is a compound is replaced by its children, in their order; child numbers refer to
  /// the resulting list, children().
  /// @throws InvalidArgument if there is no child, one has no shape, or there are more pieces
  ///         (triangles and convex shapes) than a mesh may have triangles, 2^27.
  explicit CompoundShape(const std::vector<CompoundChild>& children);

  /// Meshes and convex shapes only.
  std::span<const CompoundChild> children() const { return children_; }

  ShapeKind kind() const override { return ShapeKind::Compound; }
  AlignedBox bounding_box() const override { return bounding_box_; }
  Scalar bounding_radius() const override { return bounding_radius_; }

  /// The sum over the children, each of this density: where they overlap the mass counts twice.
  /// @throws InvalidArgument if density is not finite and positive, or a child encloses no volume;
  ///         the message names the child.
  MassProperties compute_mass_properties(Scalar density) const override;

  /// For traversals.
  const geometry_internal::CompoundTree& tree() const { return *tree_; }

 private:
  std::vector<CompoundChild> children_;
  std::shared_ptr<const geometry_internal::CompoundTree> tree_;
  AlignedBox bounding_box_;
  Scalar bounding_radius_ = 0;
};

}  // namespace dyop
