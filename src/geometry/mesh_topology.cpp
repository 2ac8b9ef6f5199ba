#include "geometry/mesh_topology.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace dyop::internal {
namespace {

bool repeats_a_vertex(const TriangleIndices& t) {
  return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

}  // namespace

bool is_closed_surface(std::span<const TriangleIndices> triangles) {
  // An edge as (smaller, larger, direction) in one number; sorted, both uses of it are neighbours.
  std::vector<std::pair<std::uint64_t, bool>> edges;
  edges.reserve(3 * triangles.size());
  for (const TriangleIndices& t : triangles) {
    if (repeats_a_vertex(t)) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t from = t[k];
      const std::int32_t to = t[(k + 1) % 3];
      const auto [low, high] = std::minmax({from, to});
      edges.emplace_back(std::uint64_t(low) << 32 | std::uint64_t(high), from < to);
    }
  }
  if (edges.empty() || edges.size() % 2 != 0) return false;
  std::sort(edges.begin(), edges.end());
  for (std::size_t k = 0; k < edges.size(); k += 2) {
    const bool is_pair =
        edges[k].first == edges[k + 1].first && edges[k].second != edges[k + 1].second;
    if (!is_pair) return false;
    if (k > 0 && edges[k].first == edges[k - 1].first) return false;
  }
  return true;
}

std::vector<std::int32_t> part_vertices(std::size_t vertex_count,
                                        std::span<const TriangleIndices> triangles) {
  std::vector<std::int32_t> leader(vertex_count);
  std::iota(leader.begin(), leader.end(), 0);
  // Halves the path on the way up, so that paths stay short.
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
  std::vector<bool> is_seen(vertex_count, false);
  for (const TriangleIndices& t : triangles) {
    const auto part = std::size_t(find(t[0]));
    if (!is_seen[part]) parts.push_back(t[0]);
    is_seen[part] = true;
  }
  return parts;
}

}  // namespace dyop::internal
