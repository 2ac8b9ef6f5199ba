// SPDX-License-Identifier: BSD-3-Clause
#include "support/oracles/path_oracle.h"

#include <algorithm>
#include <array>
#include <vector>

namespace dyop::testing {
namespace {

template <typename Number>
using PathPoint = std::array<Number, 3>;

template <typename Number>
PathPoint<Number> subtract(const PathPoint<Number>& x, const PathPoint<Number>& y) {
  return {x[0] - y[0], x[1] - y[1], x[2] - y[2]};
}

template <typename Number>
Number dot(const PathPoint<Number>& x, const PathPoint<Number>& y) {
  return x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
}

template <typename Number>
PathPoint<Number> cross(const PathPoint<Number>& x, const PathPoint<Number>& y) {
  return {x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]};
}

template <typename Number>
PathPoint<Number> position(const VertexPath& path, Number s) {
  PathPoint<Number> p;
  for (int i = 0; i < 3; ++i) {
    const auto begin = static_cast<Number>(path.begin[i]);
    p[static_cast<std::size_t>(i)] = begin + s * (static_cast<Number>(path.end[i]) - begin);
  }
  return p;
}

template <typename Number>
Number segment_distance_sq(const PathPoint<Number>& x, const PathPoint<Number>& p,
                           const PathPoint<Number>& q) {
  const PathPoint<Number> edge = subtract(q, p);
  PathPoint<Number> offset = subtract(x, p);
  const Number length_sq = dot(edge, edge);
  Number foot = length_sq > 0 ? dot(offset, edge) / length_sq : Number(0);
  foot = std::min(Number(1), std::max(Number(0), foot));
  for (std::size_t i = 0; i < 3; ++i) offset[i] -= foot * edge[i];
  return dot(offset, offset);
}

// Whether a cross product is more than rounding of positions of this size. A plane through points
// on a line is noise, and so is its foot; their vertices and edges are then sufficient.
template <typename Number>
bool is_plane(const PathPoint<Number>& u, const PathPoint<Number>& v, Number normal_sq,
              Number size_sq) {
  const auto noise_sq = static_cast<Number>(sizeof(Number) > sizeof(double) ? 1e-64 : 1e-28);
  return normal_sq > noise_sq * size_sq * (dot(u, u) + dot(v, v));
}

template <typename Number>
Number distance_at(const VertexFacePaths& paths, Number s) {
  const PathPoint<Number> v = position(paths.vertex, s);
  const std::array f{position(paths.face[0], s), position(paths.face[1], s),
                     position(paths.face[2], s)};
  const PathPoint<Number> side_b = subtract(f[1], f[0]);
  const PathPoint<Number> side_c = subtract(f[2], f[0]);
  const PathPoint<Number> normal = cross(side_b, side_c);
  const Number normal_sq = dot(normal, normal);
  Number least = segment_distance_sq(v, f[2], f[0]);
  bool is_over_face = is_plane(side_b, side_c, normal_sq, dot(v, v) + dot(f[0], f[0]));
  for (std::size_t i = 0; i < 3; ++i) {
    const PathPoint<Number>& next = f[(i + 1) % 3];
    least = std::min(least, segment_distance_sq(v, f[i], next));
    is_over_face = is_over_face && dot(normal, cross(subtract(next, f[i]), subtract(v, f[i]))) >= 0;
  }
  const Number height = dot(normal, subtract(v, f[0]));
  if (is_over_face) least = std::min(least, height * height / normal_sq);
  return square_root(least);
}

template <typename Number>
Number distance_at(const EdgeEdgePaths& paths, Number s) {
  const PathPoint<Number> a0 = position(paths.edge_a[0], s);
  const PathPoint<Number> a1 = position(paths.edge_a[1], s);
  const PathPoint<Number> b0 = position(paths.edge_b[0], s);
  const PathPoint<Number> b1 = position(paths.edge_b[1], s);
  Number least =
      std::min(std::min(segment_distance_sq(a0, b0, b1), segment_distance_sq(a1, b0, b1)),
               std::min(segment_distance_sq(b0, a0, a1), segment_distance_sq(b1, a0, a1)));
  const PathPoint<Number> u = subtract(a1, a0);
  const PathPoint<Number> v = subtract(b1, b0);
  const PathPoint<Number> w = subtract(b0, a0);
  const PathPoint<Number> normal = cross(u, v);
  const Number normal_sq = dot(normal, normal);
  const Number on_a = dot(cross(w, v), normal);
  const Number on_b = dot(cross(w, u), normal);
  if (is_plane(u, v, normal_sq, dot(a0, a0) + dot(b0, b0)) && on_a >= 0 && on_a <= normal_sq &&
      on_b >= 0 && on_b <= normal_sq) {
    const Number height = dot(normal, w);
    least = std::min(least, height * height / normal_sq);
  }
  return square_root(least);
}

template <typename Paths>
Quad golden_section(const Paths& paths, Quad begin, Quad end) {
  const Quad ratio = (square_root(Quad(5)) - 1) / 2;
  Quad left = end - ratio * (end - begin);
  Quad right = begin + ratio * (end - begin);
  Quad at_left = distance_at(paths, left);
  Quad at_right = distance_at(paths, right);
  constexpr int kSteps = 140;  // 0.618^140 < 1e-29
  for (int step = 0; step < kSteps; ++step) {
    if (at_left <= at_right) {
      end = right;
      right = left;
      at_right = at_left;
      left = end - ratio * (end - begin);
      at_left = distance_at(paths, left);
    } else {
      begin = left;
      left = right;
      at_left = at_right;
      right = begin + ratio * (end - begin);
      at_right = distance_at(paths, right);
    }
  }
  return std::min(at_left, at_right);
}

template <typename Paths>
Quad least_distance(const Paths& paths, int samples) {
  std::vector<double> sampled;
  for (int i = 0; i <= samples; ++i) {
    sampled.push_back(distance_at(paths, static_cast<double>(i) / samples));
  }
  const auto at = [&](int i) { return sampled[static_cast<std::size_t>(i)]; };
  Quad least = std::min(distance_at(paths, Quad(0)), distance_at(paths, Quad(1)));
  for (int i = 0; i <= samples; ++i) {
    // Only the first sample of a plateau.
    const bool is_least = (i == 0 || at(i) < at(i - 1)) && (i == samples || at(i) <= at(i + 1));
    if (!is_least || least <= 0) continue;
    const int first = std::max(0, i - 1);
    const int last = std::min(samples, i + 1);
    least = std::min(least, distance_at(paths, Quad(i) / samples));
    least = std::min(least, golden_section(paths, Quad(first) / samples, Quad(last) / samples));
  }
  return least;
}

}  // namespace

Quad path_distance(const VertexFacePaths& paths, Quad s) {
  return distance_at(paths, s);
}

Quad path_distance(const EdgeEdgePaths& paths, Quad s) {
  return distance_at(paths, s);
}

Quad least_path_distance(const VertexFacePaths& paths, int samples) {
  return least_distance(paths, samples);
}

Quad least_path_distance(const EdgeEdgePaths& paths, int samples) {
  return least_distance(paths, samples);
}

}  // namespace dyop::testing
