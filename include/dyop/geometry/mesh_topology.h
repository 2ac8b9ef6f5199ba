// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "dyop/core/types.h"

namespace DYOP_EXPORT dyop {

/// How the triangles of a mesh are connected, by vertex numbers alone: unchanged when vertices
/// move.
///
/// Side 3 t + k is the side of triangle t from its corner k to the next one; corner 3 t + k is that
/// corner. Sides that join the same two vertex numbers are one edge; a side from a vertex to itself
/// has no edge. Edges are numbered by their smaller vertex, then by their larger one.
class MeshTopology {
 public:
  MeshTopology(std::size_t vertex_count, std::span<const TriangleIndices> triangles);

  std::int32_t edge_count() const { return static_cast<std::int32_t>(edges_.size()); }
  std::int32_t vertex_count() const { return static_cast<std::int32_t>(first_corner_.size()) - 1; }

  /// The two vertices of an edge, smaller number first.
  const std::array<std::int32_t, 2>& edge(std::int32_t edge) const {
    return edges_[static_cast<std::size_t>(edge)];
  }
  /// The edge of a side; none for a side from a vertex to itself.
  std::optional<std::int32_t> edge_of_side(std::int32_t side) const {
    const std::int32_t edge = edge_of_side_[static_cast<std::size_t>(side)];
    return edge >= 0 ? std::optional(edge) : std::nullopt;
  }
  /// The sides of an edge, one per triangle and use, in ascending order. The first owns the edge.
  std::span<const std::int32_t> sides_of_edge(std::int32_t edge) const {
    return part(sides_, first_side_, edge);
  }
  /// The corners at a vertex, in ascending order; the triangle of the first owns it. Empty if no
  /// triangle uses it.
  std::span<const std::int32_t> corners_of_vertex(std::int32_t vertex) const {
    return part(corners_, first_corner_, vertex);
  }

  /// See TriangleMesh::is_closed().
  bool is_closed() const { return is_closed_; }

 private:
  static std::span<const std::int32_t> part(const std::vector<std::int32_t>& list,
                                            const std::vector<std::int32_t>& first,
                                            std::int32_t number) {
    const auto k = static_cast<std::size_t>(number);
    return std::span(list).subspan(static_cast<std::size_t>(first[k]),
                                   static_cast<std::size_t>(first[k + 1] - first[k]));
  }
  void sort_corners(std::size_t vertex_count, std::span<const TriangleIndices> triangles);
  void join_sides(std::size_t vertex_count, std::span<const TriangleIndices> triangles);
  bool find_closed(std::span<const TriangleIndices> triangles) const;

  std::vector<std::array<std::int32_t, 2>> edges_;
  std::vector<std::int32_t> edge_of_side_;  // negative: none
  std::vector<std::int32_t> first_side_;    // by edge: index into sides_; and the end
  std::vector<std::int32_t> sides_;
  std::vector<std::int32_t> first_corner_;  // by vertex: index into corners_; and the end
  std::vector<std::int32_t> corners_;
  bool is_closed_ = false;
};

}  // namespace dyop
