// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dyop/core/types.h"
#include "dyop/geometry/triangle_mesh.h"

namespace DYOP_EXPORT dyop {

/// The part of a deforming mesh's interval that a query covers, as fractions of it: the vertices go
/// from their places at `begin` to those at `end`, at constant speed. Equal ones: they stand still.
struct DeformingSpan {
  Scalar begin = 0;  ///< 0 <= begin <= end <= 1
  Scalar end = 1;
};

/// A triangle mesh that deforms: each vertex moves on a straight line, at constant speed, from its
/// place at the start of an interval to its place at the end. World frame throughout. The interval
/// itself is given with each query.
///
/// The hierarchy is built once; new positions only refit its boxes. As in TriangleMesh, any set of
/// triangles is legal: open, self-touching, with segments and points.
class DeformingMesh {
 public:
  /// A node of a binary tree of axis-aligned boxes. At the fraction s of the interval its vertices
  /// are within the box with the corners (1 - s) at_begin + s at_end.
  struct Node {
    AlignedBox at_begin;
    AlignedBox at_end;
    std::int32_t first = -1;  ///< inner: the children are nodes first and first + 1; leaf: triangle
    bool is_leaf = false;
  };

  /// @throws InvalidArgument if there is no triangle, the arrays differ in length, a coordinate is
  ///         not finite or beyond kLargestCoordinate, or an index is out of range; the message
  ///         names it.
  DeformingMesh(std::vector<Vector3> begin, std::vector<Vector3> end,
                std::vector<TriangleIndices> triangles);

  /// Gives all vertices new positions, as many as before. Linear in the size; the tree keeps its
  /// structure, so queries slow down if neighbours drift far apart. Allocates nothing.
  /// @throws InvalidArgument as above; the mesh is then unchanged.
  void refit(std::span<const Vector3> begin, std::span<const Vector3> end);

  /// Starts the next interval where the last one ended.
  /// @throws InvalidArgument as refit(); the mesh is then unchanged.
  void advance(std::span<const Vector3> next_end);

  std::span<const Vector3> begin() const { return begin_; }
  std::span<const Vector3> end() const { return end_; }
  std::span<const TriangleIndices> triangles() const { return triangles_; }

  /// A triangle at the fraction s of the interval, 0 <= s <= 1, rounded; exact at 0 and 1.
  Triangle triangle(std::int32_t index, Scalar s) const;

  /// The mesh at the fraction s of the interval, with the same triangle and vertex numbers; its
  /// vertices are those of triangle().
  TriangleMesh snapshot(Scalar s) const;

  /// Node 0 is the root; children come after their parents.
  std::span<const Node> nodes() const { return nodes_; }

  /// Largest distance of a vertex from the world's origin, and largest displacement of a vertex
  /// over the interval; both over vertices that triangles use, rounded up.
  Scalar largest_radius() const { return largest_radius_; }
  Scalar largest_displacement() const { return largest_displacement_; }

 private:
  Vector3 vertex(std::size_t number, Scalar s) const {
    return s >= 1 ? end_[number] : Vector3(begin_[number] + s * (end_[number] - begin_[number]));
  }
  void build();
  void fit_boxes();

  std::vector<Vector3> begin_;
  std::vector<Vector3> end_;
  std::vector<TriangleIndices> triangles_;
  std::vector<Node> nodes_;
  Scalar largest_radius_ = 0;
  Scalar largest_displacement_ = 0;
};

}  // namespace dyop
