// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "core/assert.h"
#include "dyop/core/export.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/hierarchy/mesh_hierarchy.h"
#include "geometry/compound_tree.h"
#include "hierarchy/box_gaps.h"

namespace dyop::geometry_internal {

/// What a leaf of a ShapeTree holds: a triangle of a mesh, or a convex shape, in the tree's frame.
struct LeafPiece {
  const TriangleMesh* mesh = nullptr;
  const ConvexShape* convex = nullptr;
  std::int32_t triangle = 0;          ///< number of a mesh's triangle
  std::optional<std::int32_t> child;  ///< number of a compound's child

  Triangle corners() const { return mesh->triangle(triangle); }
  const TriangleIndices& indices() const {
    return mesh->triangles()[static_cast<std::size_t>(triangle)];
  }
};

inline GroupRows rows_of(const BoxGroup& boxes, const BoxFrame& frame) {
  return {boxes.rows, frame.scale, {frame.origin.x(), frame.origin.y(), frame.origin.z()}};
}

/// One view of all kinds of shape for traversals: a tree of oriented boxes whose leaves are pieces,
/// each a triangle of a mesh or a whole convex shape. Does not own the shape.
///
/// A box is identified by eight times its node plus its column in it; box 0 is the root.
///
/// The box of a convex shape holds its core only: what a box holds is inflated by rounding(), so
/// that a ball is searched for like its centre. A gap of boxes minus both roundings is a bound on
/// the distance of what they hold.
class DYOP_EXPORT ShapeTree {
 public:
  /// Of a convex shape: without a box the tree is one leaf, whose box must not be asked for.
  enum class ConvexBox { Fitted, None };

  /// @param extent Of a half-space: only its part within this distance of the origin matters.
  explicit ShapeTree(const Shape& shape, Scalar extent = kInfinity,
                     ConvexBox box = ConvexBox::Fitted);
  ShapeTree(const ShapeTree&) = delete;
  ShapeTree& operator=(const ShapeTree&) = delete;

  static constexpr std::int32_t kRoot = 0;

  const MeshHierarchy::Node& node(std::int32_t node) const {
    DYOP_ASSERT(node >= 0 && node < node_count_, node, " of ", node_count_);
    return nodes_[node];
  }
  const MeshHierarchy::Node& node_of(std::int32_t box) const {
    DYOP_ASSERT(box >= 0, box);
    return node(box / BoxGroup::kWidth);
  }
  static int column_of(std::int32_t box) { return box % BoxGroup::kWidth; }
  static std::int32_t box_number(std::int32_t node, int column) {
    return node * BoxGroup::kWidth + column;
  }

  OrientedBox box(std::int32_t box) const { return node_of(box).boxes.box(column_of(box), frame_); }
  /// The boxes of a node, for the wide kernels.
  GroupRows rows(std::int32_t node) const { return rows_of(this->node(node).boxes, frame_); }
  /// Of the boxes of all nodes.
  const BoxFrame& frame() const { return frame_; }
  /// Prefetches a node that is needed soon. Speed only.
  void fetch(std::int32_t node) const {
    constexpr std::size_t kCacheLine = 64;
    const char* begin = reinterpret_cast<const char*>(&this->node(node));
    for (std::size_t i = 0; i < sizeof(MeshHierarchy::Node); i += kCacheLine) {
      __builtin_prefetch(begin + i);
    }
  }
  Scalar squared_half_diagonal(std::int32_t box) const {
    return frame_.scale * frame_.scale *
           static_cast<Scalar>(node_of(box).boxes.squared_half_diagonal(column_of(box)));
  }
  bool is_leaf(std::int32_t box) const { return node_of(box).child[column_of(box)] < 0; }
  /// Whether a number from outside identifies a leaf of this tree.
  bool has_leaf(std::int32_t box) const;
  /// The node with the parts of a box that is not a leaf.
  std::int32_t child(std::int32_t box) const { return node_of(box).child[column_of(box)]; }
  /// Triangle number of a leaf of a mesh.
  std::int32_t triangle(std::int32_t leaf) const {
    DYOP_ASSERT(is_leaf(leaf), leaf);
    return -1 - child(leaf);
  }

  LeafPiece piece(std::int32_t leaf) const {
    if (mesh_) return {mesh_, nullptr, triangle(leaf), std::nullopt};
    if (convex_) return {nullptr, convex_, 0, std::nullopt};
    return compound_piece(leaf);
  }

  /// Radius of the ball that inflates what the boxes hold: of a convex shape, else 0.
  Scalar rounding() const { return rounding_; }

  /// Null unless the shape is of that kind.
  const TriangleMesh* mesh() const { return mesh_; }
  const ConvexShape* convex() const { return convex_; }

 private:
  void set_half_space();
  void set_convex();
  void set_one_leaf();
  void set_one_box(const OrientedBox& box);
  LeafPiece compound_piece(std::int32_t leaf) const;

  const TriangleMesh* mesh_ = nullptr;
  const ConvexShape* convex_ = nullptr;
  std::optional<HalfSpace> half_space_;  // its part that matters
  const CompoundTree* compound_ = nullptr;
  const MeshHierarchy::Node* nodes_ = nullptr;
  std::int32_t node_count_ = 1;
  MeshHierarchy::Node convex_node_;
  BoxFrame frame_;
  Scalar rounding_ = 0;
};

/// Within which distance of its frame's origin a shape must be known for a query against another
/// one whose frame's origin is at most `apart` from it: see HalfSpace::within().
inline Scalar extent_beside(const Shape& shape, const Shape& other, Scalar apart) {
  if (!as_half_space(shape)) return kInfinity;
  return apart + (as_half_space(other) ? apart : other.bounding_radius());
}

/// Shape::bounding_radius(), of a half-space that of its part that matters beside another shape.
inline Scalar radius_beside(const Shape& shape, const Shape& other, Scalar apart) {
  const HalfSpace* half_space = as_half_space(shape);
  return half_space ? half_space->within(extent_beside(shape, other, apart)).bounding_radius()
                    : shape.bounding_radius();
}

/// A box in the frame S of another shape. X_SO is the pose of the box's shape.
DYOP_EXPORT FacingBox facing_box(const OrientedBox& box, const RigidPose& X_SO);

/// Whether box `a` is to be opened before `b`: the larger one that is not a leaf goes first. At
/// least one must not be a leaf.
template <typename Tree>
bool opens_first(const Tree& tree_a, std::int32_t a, const Tree& tree_b, std::int32_t b) {
  DYOP_ASSERT(!tree_a.is_leaf(a) || !tree_b.is_leaf(b), a, ' ', b);
  if (tree_a.is_leaf(a)) return false;
  return tree_b.is_leaf(b) || tree_a.squared_half_diagonal(a) >= tree_b.squared_half_diagonal(b);
}

/// A child of a compound, as a mesh or convex shape in the compound's frame; another shape itself.
inline const Shape& shape_part(const Shape& shape, std::int32_t child) {
  if (shape.kind() != ShapeKind::Compound) return shape;
  return static_cast<const CompoundShape&>(shape).tree().part(child).shape();
}

}  // namespace dyop::geometry_internal
