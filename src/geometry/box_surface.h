// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "dyop/core/types.h"

namespace dyop::geometry_internal {

/// The triangles of every Box: two per face, counterclockwise seen from outside; -x, +x, -y, +y,
/// -z, +z. Bit k of a corner's number is set where coordinate k is positive.
inline constexpr std::array<TriangleIndices, 12> kBoxTriangles{{{0, 4, 6},
                                                                {0, 6, 2},
                                                                {1, 3, 7},
                                                                {1, 7, 5},
                                                                {0, 1, 5},
                                                                {0, 5, 4},
                                                                {2, 6, 7},
                                                                {2, 7, 3},
                                                                {0, 2, 3},
                                                                {0, 3, 1},
                                                                {4, 5, 7},
                                                                {4, 7, 6}}};

/// An edge of that surface, as the side of the triangle that owns it (MeshTopology).
struct BoxEdge {
  std::int32_t side = 0;
  std::int32_t from = 0;
  std::int32_t to = 0;

  constexpr std::int32_t low() const { return std::min(from, to); }
  constexpr std::int32_t high() const { return std::max(from, to); }
  /// Of a face: it changes two coordinates.
  constexpr bool is_diagonal() const { return ((from ^ to) & ((from ^ to) - 1)) != 0; }
};

/// By their numbers in MeshTopology: twelve edges of the box, six diagonals of its faces.
inline constexpr std::array<BoxEdge, 18> kBoxEdges = [] {
  std::array<BoxEdge, 18> edges{};
  std::size_t count = 0;
  for (std::int32_t side = 0; side < 36; ++side) {
    const TriangleIndices& t = kBoxTriangles[std::size_t(side / 3)];
    const BoxEdge edge{side, t[std::size_t(side % 3)], t[std::size_t((side + 1) % 3)]};
    const bool is_known = std::any_of(edges.begin(), edges.begin() + count, [&](const BoxEdge& e) {
      return e.low() == edge.low() && e.high() == edge.high();
    });
    if (!is_known) edges[count++] = edge;
  }
  std::sort(edges.begin(), edges.end(), [](const BoxEdge& x, const BoxEdge& y) {
    return x.low() != y.low() ? x.low() < y.low() : x.high() < y.high();
  });
  return edges;
}();

/// The number of the edge along `axis` whose other two coordinates, in cyclic order after the axis,
/// have the signs of bits 0 and 1 of `place`.
inline constexpr auto kBoxEdgeAt = [] {
  std::array<std::array<std::int32_t, 4>, 3> numbers{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t place = 0; place < 4; ++place) {
      const auto low =
          std::int32_t((place & 1) << ((axis + 1) % 3) | (place >> 1) << ((axis + 2) % 3));
      const std::int32_t high = low | std::int32_t(1) << axis;
      for (std::size_t k = 0; k < kBoxEdges.size(); ++k) {
        if (kBoxEdges[k].low() == low && kBoxEdges[k].high() == high) {
          numbers[axis][place] = std::int32_t(k);
        }
      }
    }
  }
  return numbers;
}();

}  // namespace dyop::geometry_internal
