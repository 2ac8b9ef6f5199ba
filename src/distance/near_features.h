// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <span>

#include "dyop/core/export.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop::distance_internal {

/// The features of a closed convex surface that may be near another one, in the common frame.
/// Holds its own memory: to be used on the stack.
class DYOP_EXPORT NearFeatures {
 public:
  /// Larger surfaces are left to their trees.
  static constexpr std::size_t kMostTriangles = 256;
  static constexpr std::size_t kMostVertices = kMostTriangles / 2 + 2;
  /// More triangles that are near are left to the trees too: one bit of a word each.
  static constexpr std::size_t kMostNear = 64;
  static constexpr std::size_t kMostSides = 3 * kMostNear;

  /// @param X_AS The surface's frame in the common one.
  NearFeatures(const TriangleMesh& surface, const RigidPose& X_AS);

  static bool serves(const TriangleMesh* surface) {
    return surface && surface->triangles().size() <= kMostTriangles &&
           surface->vertices().size() <= kMostVertices && surface->is_closed();
  }

  /// The heights of all vertices along a unit direction; returns the largest.
  Scalar measure(const Vector3& direction_A);
  /// Gathers the vertices at least so high along the last direction, the triangles with such a
  /// corner, and the edges with such an end. Returns false if there are too many.
  bool gather(Scalar least_height);
  /// The planes of the gathered triangles, for leave_out_beyond() of the other surface.
  void find_planes(Scalar reach, Scalar noise);
  /// Leaves out what is farther than the reach beyond the plane of a gathered triangle of the
  /// other.
  void leave_out_beyond(const NearFeatures& other);

  std::span<const std::int32_t> vertices() const {
    return std::span(vertices_).first(vertex_count_);
  }
  std::size_t triangle_count() const { return triangle_count_; }
  /// The number of the k-th gathered triangle, and its corners.
  std::int32_t triangle(std::size_t k) const { return triangles_[k]; }
  Triangle corners(std::size_t k) const {
    const TriangleIndices& t = indices_[std::size_t(triangles_[k])];
    return {point(t[0]), point(t[1]), point(t[2])};
  }
  /// One side per edge, the one that owns it (MeshTopology).
  std::span<const std::int32_t> sides() const { return std::span(sides_).first(side_count_); }

  /// A gathered vertex, or a corner of a gathered triangle.
  const Vector3& point(std::int32_t vertex) const { return points_[std::size_t(vertex)]; }
  /// The other surface's gathered triangles whose planes a gathered vertex is above, or in; one bit
  /// each.
  std::uint64_t triangles_below(std::int32_t vertex) const { return above_[std::size_t(vertex)]; }
  /// Whether a gathered triangle is still there after leave_out_beyond().
  bool is_near(std::size_t k) const { return (far_triangles_ >> k & 1) == 0; }

 private:
  std::uint64_t all_triangles() const {
    return triangle_count_ == 0 ? 0 : ~std::uint64_t{0} >> (kMostNear - triangle_count_);
  }
  bool add_triangle(std::int32_t triangle);
  void compare(std::int32_t vertex, const NearFeatures& other);
  bool is_beyond_one_plane(std::int32_t side) const;

  const MeshTopology& topology_;
  std::span<const Vector3> vertices_of_surface_;
  std::span<const TriangleIndices> indices_;
  const RigidPose& X_AS_;
  std::array<Scalar, kMostVertices> heights_;
  std::array<Vector3, kMostVertices> points_;
  std::array<std::uint64_t, kMostVertices> beyond_;  // planes of the other, one bit each
  std::array<std::uint64_t, kMostVertices> above_;
  std::bitset<kMostVertices> is_near_;
  std::bitset<kMostTriangles> is_listed_;
  std::array<std::int32_t, kMostNear> vertices_;
  std::array<std::int32_t, kMostVertices> corners_;  // of all gathered triangles
  std::array<std::int32_t, kMostNear> triangles_;
  std::array<std::int32_t, kMostSides> sides_;
  std::bitset<kMostVertices> is_corner_;
  std::size_t vertex_count_ = 0;
  std::size_t corner_count_ = 0;
  std::size_t triangle_count_ = 0;
  std::size_t side_count_ = 0;
  std::uint64_t far_triangles_ = 0;
  // By gathered triangle: its plane normal . x = offset, and the values between which a point is
  // above it and within reach.
  std::array<std::array<Scalar, kMostNear>, 3> normals_;
  std::array<Scalar, kMostNear> offsets_;
  std::array<Scalar, kMostNear> least_;
  std::array<Scalar, kMostNear> most_;
};

enum class NearSearch : std::uint8_t {
  Found,     ///< both sets hold every feature of a pair of features within reach, and few others
  None,      ///< the cores are farther apart than the reach
  Unserved,  ///< surfaces that are open, absent or too large, or too much of them is near
};

/// Gathers the features of two convex polytopes that may be within reach of each other: those in
/// the reach of each other's slab along a direction that nearly separates the two, and of the
/// planes of those faces. Any direction leaves out correctly; a good one leaves out most.
///
/// For a unit direction n let M be the largest n . x over A's core and m the least over B's. A
/// point of A within reach r of B has n . x >= m - r, so only vertices in that slab, and triangles
/// and edges with such a corner, can be part of a contact; likewise for B. What lies more than r
/// beyond the plane of one of the other's faces is left out too, because that plane bounds the
/// other. Rounding is allowed for by 4 (slab) and 256 (planes) times the noise; faces with a corner
/// sharper than a sine of 1/1024 bound nothing.
///
/// A point above a convex solid is above the plane of the face, or of one face beside the edge or
/// the corner, that is nearest to it.
///
/// @param reach At most so far apart, between the cores.
/// @param noise Allowance for rounding in a distance, length.
DYOP_EXPORT NearSearch find_near_features(const ConvexShape& a, const ConvexShape& b,
                                          const RigidPose& X_AB, Scalar reach, Scalar noise,
                                          NearFeatures& of_a, NearFeatures& of_b);

}  // namespace dyop::distance_internal
