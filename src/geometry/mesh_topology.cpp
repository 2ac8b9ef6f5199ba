// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/mesh_topology.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "geometry/mesh_topology.h"

namespace dyop {
namespace {

bool repeats_a_vertex(const TriangleIndices& t) {
  return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

// A side as seen from the smaller of its vertices.
struct SideEnd {
  std::int32_t larger;
  std::int32_t side;

  friend auto operator<=>(const SideEnd&, const SideEnd&) = default;
};

// Turns counts into the start of each part of a list.
void sum_up(std::vector<std::int32_t>& counts) {
  std::exclusive_scan(counts.begin(), counts.end(), counts.begin(), 0);
}

}  // namespace

MeshTopology::MeshTopology(std::size_t vertex_count, std::span<const TriangleIndices> triangles) {
  sort_corners(vertex_count, triangles);
  join_sides(vertex_count, triangles);
  is_closed_ = find_closed(triangles);
}

void MeshTopology::sort_corners(std::size_t vertex_count,
                                std::span<const TriangleIndices> triangles) {
  first_corner_.assign(vertex_count + 1, 0);
  for (const TriangleIndices& t : triangles) {
    for (const std::int32_t v : t) ++first_corner_[std::size_t(v)];
  }
  sum_up(first_corner_);
  corners_.resize(3 * triangles.size());
  std::vector<std::int32_t> next(first_corner_.begin(), first_corner_.end() - 1);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      corners_[std::size_t(next[std::size_t(triangles[t][k])]++)] = std::int32_t(3 * t + k);
    }
  }
}

// Sides are grouped by their smaller vertex, then sorted within each vertex, which has few.
void MeshTopology::join_sides(std::size_t vertex_count,
                              std::span<const TriangleIndices> triangles) {
  std::vector<std::int32_t> first(vertex_count + 1, 0);
  for (const TriangleIndices& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t from = t[k];
      const std::int32_t to = t[k < 2 ? k + 1 : 0];
      if (from != to) ++first[std::size_t(std::min(from, to))];
    }
  }
  sum_up(first);
  std::vector<SideEnd> ends(std::size_t(first.back()));
  std::vector<std::int32_t> next(first.begin(), first.end() - 1);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t from = triangles[t][k];
      const std::int32_t to = triangles[t][k < 2 ? k + 1 : 0];
      if (from == to) continue;
      ends[std::size_t(next[std::size_t(std::min(from, to))]++)] = {std::max(from, to),
                                                                    std::int32_t(3 * t + k)};
    }
  }
  edges_.reserve(ends.size() / 2 + 1);
  first_side_.reserve(ends.size() / 2 + 2);
  edge_of_side_.assign(3 * triangles.size(), -1);
  sides_.resize(ends.size());
  for (std::size_t v = 0; v < vertex_count; ++v) {
    const auto begin = std::size_t(first[v]);
    const auto end = std::size_t(first[v + 1]);
    std::sort(ends.begin() + first[v], ends.begin() + first[v + 1]);
    for (std::size_t k = begin; k < end; ++k) {
      if (k == begin || ends[k].larger != ends[k - 1].larger) {
        edges_.push_back({std::int32_t(v), ends[k].larger});
        first_side_.push_back(std::int32_t(k));
      }
      sides_[k] = ends[k].side;
      edge_of_side_[std::size_t(ends[k].side)] = edge_count() - 1;
    }
  }
  first_side_.push_back(std::int32_t(ends.size()));
}

bool MeshTopology::find_closed(std::span<const TriangleIndices> triangles) const {
  bool is_any = false;
  for (std::int32_t e = 0; e < edge_count(); ++e) {
    int uses = 0;
    int direction = 0;
    for (const std::int32_t side : sides_of_edge(e)) {
      const TriangleIndices& t = triangles[std::size_t(side / 3)];
      if (repeats_a_vertex(t)) continue;
      ++uses;
      direction += t[std::size_t(side % 3)] == edge(e)[0] ? 1 : -1;
    }
    if (uses == 0) continue;
    if (uses != 2 || direction != 0) return false;
    is_any = true;
  }
  return is_any;
}

namespace geometry_internal {

std::vector<std::int32_t> parts_of_triangles(std::size_t vertex_count,
                                             std::span<const TriangleIndices> triangles) {
  std::vector<std::int32_t> leader(vertex_count);
  std::iota(leader.begin(), leader.end(), 0);
  // Halves the path on the way to the root, so that paths stay short.
  const auto find = [&](std::int32_t v) {
    const auto up = [&](std::int32_t x) -> std::int32_t& { return leader[std::size_t(x)]; };
    while (up(v) != v) v = up(v) = up(up(v));
    return v;
  };
  for (const TriangleIndices& t : triangles) {
    const std::int32_t first = find(t[0]);
    leader[std::size_t(find(t[1]))] = first;
    leader[std::size_t(find(t[2]))] = first;
  }
  std::vector<std::int32_t> parts;
  for (const TriangleIndices& t : triangles) parts.push_back(find(t[0]));
  return parts;
}

std::vector<std::int32_t> part_vertices(std::size_t vertex_count,
                                        std::span<const TriangleIndices> triangles) {
  const std::vector<std::int32_t> part_of = parts_of_triangles(vertex_count, triangles);
  std::vector<std::int32_t> parts;
  std::vector<bool> is_seen(vertex_count, false);
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    const auto part = std::size_t(part_of[k]);
    if (!is_seen[part]) parts.push_back(triangles[k][0]);
    is_seen[part] = true;
  }
  return parts;
}

}  // namespace geometry_internal
}  // namespace dyop
