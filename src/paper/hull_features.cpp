// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <utility>

#include "dyop/paper/lin_canny.h"

namespace dyop {
namespace {

// One side of a face: its ends in increasing order, and where it was found.
struct Side {
  std::array<std::int32_t, 2> ends;
  std::int32_t face;
  std::size_t corner;
};

// The sides of faces with area; a segment, which is a triangle with a repeated vertex, has one
// side.
std::vector<Side> collect_sides(const ConvexHull& hull) {
  std::vector<Side> sides;
  const auto triangles = hull.core_surface()->triangles();
  for (std::size_t face = 0; face < triangles.size(); ++face) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t from = triangles[face][k];
      const std::int32_t to = triangles[face][(k + 1) % 3];
      if (from == to) continue;
      sides.push_back(
          {{std::min(from, to), std::max(from, to)}, static_cast<std::int32_t>(face), k});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) {
    return std::pair(x.ends, x.face) < std::pair(y.ends, y.face);
  });
  return sides;
}

}  // namespace

HullFeatures::HullFeatures(ConvexHull hull) : hull_(std::move(hull)) {
  edges_of_face_.assign(hull_.core_surface()->triangles().size(), {-1, -1, -1});
  const bool has_faces = hull_.dimension() >= 2;
  for (const Side& side : collect_sides(hull_)) {
    const bool is_new = edges_.empty() || edges_.back().vertices != side.ends;
    if (is_new) edges_.push_back({side.ends, {-1, -1}});
    if (!has_faces) continue;
    edges_.back().faces[is_new ? 0 : 1] = side.face;
    edges_of_face_[static_cast<std::size_t>(side.face)][side.corner] =
        static_cast<std::int32_t>(edges_.size()) - 1;
  }
  first_edge_.assign(hull_.vertices().size() + 1, 0);
  for (const Edge& edge : edges_) {
    for (const std::int32_t v : edge.vertices) ++first_edge_[static_cast<std::size_t>(v) + 1];
  }
  for (std::size_t v = 1; v < first_edge_.size(); ++v) first_edge_[v] += first_edge_[v - 1];
  edges_of_vertices_.resize(2 * edges_.size());
  std::vector<std::int32_t> next(first_edge_.begin(), first_edge_.end() - 1);
  for (std::size_t k = 0; k < edges_.size(); ++k) {
    for (const std::int32_t v : edges_[k].vertices) {
      const std::int32_t at = next[static_cast<std::size_t>(v)]++;
      edges_of_vertices_[static_cast<std::size_t>(at)] = static_cast<std::int32_t>(k);
    }
  }
}

std::span<const std::int32_t> HullFeatures::edges_of_vertex(std::int32_t vertex) const {
  const auto v = static_cast<std::size_t>(vertex);
  const auto first = static_cast<std::size_t>(first_edge_[v]);
  const auto end = static_cast<std::size_t>(first_edge_[v + 1]);
  return std::span(edges_of_vertices_).subspan(first, end - first);
}

}  // namespace dyop
