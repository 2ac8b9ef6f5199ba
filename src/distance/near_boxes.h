// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "dyop/core/export.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/triangle_mesh.h"
#include "geometry/box_surface.h"

namespace dyop::distance_internal {

struct BoxSide;
class BoxEdgeAxes;

/// What to look for between two boxes.
struct BoxSearch {
  Scalar reach = 0;  ///< between the cores
  Scalar noise = 0;  ///< allowance for rounding in a distance, length; >= 64u of the pair's size
  /// Only triangles whose outer side a vertex is on, to within the noise.
  bool only_outside = false;
  /// Leaves out pairs of edges whose common normal a face beside one of them rises along by more
  /// than this sine; >= 1: keeps all.
  Scalar sine = 1;
};

/// The pairs of features of two boxes that may be within reach of each other: what
/// find_near_features() leaves of two polytopes, and far less. Where the boxes lie side by side,
/// eight vertices and as many pairs of edges are left.
///
/// In a box's frame the distance of a point to a face is known from its coordinates. Edges along
/// axis i of A and j of B have one normal, e_i x f_j; heights along it, and where their lines come
/// nearest, are sums of a few products that sixteen pairs share. All of it only leaves out: each
/// test allows for rounding by several times the noise, and keeps what is NaN.
class DYOP_EXPORT NearBoxes {
 public:
  struct EdgePair {
    std::uint8_t a;  ///< numbers in kBoxEdges
    std::uint8_t b;
    /// No face beside them rises by more than the sine, for certain: the edges are not nearly
    /// parallel and farther apart than rounding.
    bool is_admitted;
  };

  /// Whether both cores are boxes with the surface of Box, of ordinary size and not too flat: all
  /// edges of the box are convex, all triangles have a certain plane.
  static bool serves(const ConvexShape& a, const TriangleMesh* surface_a, const ConvexShape& b,
                     const TriangleMesh* surface_b);

  /// @pre serves(a, a.core_surface(), b, b.core_surface()).
  NearBoxes(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB,
            const BoxSearch& search);

  /// False if a face's plane proves that nothing is near; then there are no pairs.
  bool are_near() const { return are_near_; }

  /// Without the diagonals of faces.
  std::span<const EdgePair> edge_pairs() const { return std::span(pairs_).first(pair_count_); }

  /// Calls visit(of_a, vertex, triangle) for each vertex, of A or of B, and the other's triangles
  /// that may be near.
  template <typename Visit>
  void visit_vertices(const Visit& visit) const {
    for (const bool of_a : {true, false}) {
      for (std::size_t vertex = 0; vertex < 8; ++vertex) {
        for (unsigned left = triangles_[of_a ? 0 : 1][vertex]; left != 0; left &= left - 1) {
          visit(of_a, vertex, std::size_t(std::countr_zero(left)));
        }
      }
    }
  }

 private:
  void find_triangles(const BoxSide& own, const BoxSide& other,
                      std::array<std::uint16_t, 8>& triangles);
  void find_edges(const BoxSide& a, const BoxSide& b, const RigidPose& X_AB);
  void add_edges(BoxEdgeAxes&& axes, unsigned edges_a, unsigned edges_b);

  const BoxSearch search_;
  Scalar reach_;   // with an allowance for rounding
  Scalar margin_;  // for products with directions of edges, which are worse for short edges
  std::array<std::array<std::uint16_t, 8>, 2> triangles_{};  // of the other, by vertex of A, of B
  std::array<EdgePair, 144> pairs_;
  std::size_t pair_count_ = 0;
  bool are_near_ = false;
};

/// The corners of two boxes in frame A.
class BoxCorners {
 public:
  BoxCorners(const TriangleMesh& surface_a, const TriangleMesh& surface_b, const RigidPose& X_AB) {
    const std::span<const Vector3> a = surface_a.vertices();
    const std::span<const Vector3> b = surface_b.vertices();
    for (std::size_t k = 0; k < 8; ++k) {
      points_[0][k] = a[k];
      points_[1][k] = X_AB * b[k];
    }
  }
  const Vector3& point(bool of_a, std::size_t vertex) const {
    return points_[of_a ? 0 : 1][vertex];
  }
  Triangle triangle(bool of_a, std::size_t number) const {
    const TriangleIndices& t = geometry_internal::kBoxTriangles[number];
    const auto at = [&](std::size_t k) { return point(of_a, std::size_t(t[k])); };
    return {at(0), at(1), at(2)};
  }

 private:
  std::array<std::array<Vector3, 8>, 2> points_;
};

}  // namespace dyop::distance_internal
