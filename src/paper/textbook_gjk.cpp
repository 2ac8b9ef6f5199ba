// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/paper/textbook_gjk.h"

#include <array>
#include <cmath>

#include "core/tolerance.h"

// The origin against the Minkowski difference B - A: v is its nearest point so far.
namespace dyop {
namespace {

template <int dimension>
using GjkPoint = typename GjkEstimate<dimension>::Point;

template <int dimension>
using GjkTriangle = std::array<GjkPoint<dimension>, 3>;

// Number of the vertex farthest along the direction, found without a branch.
template <int dimension>
int support(const GjkTriangle<dimension>& triangle, const GjkPoint<dimension>& direction) {
  const Scalar h0 = triangle[0].dot(direction);
  const Scalar h1 = triangle[1].dot(direction);
  const Scalar h2 = triangle[2].dot(direction);
  const Scalar highest = h1 > h0 ? h1 : h0;
  const int of_two = static_cast<int>(h1 > h0);
  return h2 > highest ? 2 : of_two;
}

// A point of the difference and the vertices it comes from.
template <int dimension>
struct GjkVertex {
  GjkPoint<dimension> w;
  int a = 0;
  int b = 0;
};

template <int dimension>
struct GjkSimplex {
  std::array<GjkVertex<dimension>, 4> vertices;
  std::array<Scalar, 4> weights{1, 0, 0, 0};
  int count = 0;

  const GjkPoint<dimension>& w(int k) const { return vertices[static_cast<std::size_t>(k)].w; }

  bool contains(int a, int b) const {
    for (int k = 0; k < count; ++k) {
      const auto& vertex = vertices[static_cast<std::size_t>(k)];
      if (vertex.a == a && vertex.b == b) return true;
    }
    return false;
  }

  GjkPoint<dimension> nearest() const {
    GjkPoint<dimension> v = GjkPoint<dimension>::Zero();
    for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
      v += weights[k] * vertices[k].w;
    }
    return v;
  }

  GjkSimplex with(std::initializer_list<std::pair<int, Scalar>> kept) const {
    GjkSimplex result;
    for (const auto& [k, weight] : kept) {
      const auto at = static_cast<std::size_t>(result.count++);
      result.vertices[at] = vertices[static_cast<std::size_t>(k)];
      result.weights[at] = weight;
    }
    return result;
  }
};

// The part of the segment i, j that contains its point nearest to the origin.
template <int dimension>
GjkSimplex<dimension> nearest_on_segment(const GjkSimplex<dimension>& s, int i, int j) {
  const GjkPoint<dimension> edge = s.w(j) - s.w(i);
  const Scalar along = -edge.dot(s.w(i));
  const Scalar length_sq = edge.squaredNorm();
  if (!(along > 0)) return s.with({{i, 1}});
  if (along >= length_sq) return s.with({{j, 1}});
  const Scalar t = along / length_sq;
  return s.with({{i, 1 - t}, {j, t}});
}

// [Ericson2005] 5.1.5: the regions of a triangle's vertices, edges and face, by six scalar
// products; first those at k, the newest vertex.
template <int dimension>
GjkSimplex<dimension> nearest_on_triangle(const GjkSimplex<dimension>& s, int i, int j, int k) {
  const GjkPoint<dimension> ki = s.w(i) - s.w(k);
  const GjkPoint<dimension> kj = s.w(j) - s.w(k);
  const Scalar d1 = -ki.dot(s.w(k));
  const Scalar d2 = -kj.dot(s.w(k));
  if (d1 <= 0 && d2 <= 0) return s.with({{k, 1}});
  const Scalar d3 = -ki.dot(s.w(i));
  const Scalar d4 = -kj.dot(s.w(i));
  if (d3 >= 0 && d4 <= d3) return s.with({{i, 1}});
  const Scalar of_j = d1 * d4 - d3 * d2;
  if (of_j <= 0 && d1 >= 0 && d3 <= 0) return nearest_on_segment(s, k, i);
  const Scalar d5 = -ki.dot(s.w(j));
  const Scalar d6 = -kj.dot(s.w(j));
  if (d6 >= 0 && d5 <= d6) return s.with({{j, 1}});
  const Scalar of_i = d5 * d2 - d1 * d6;
  if (of_i <= 0 && d2 >= 0 && d6 <= 0) return nearest_on_segment(s, k, j);
  const Scalar of_k = d3 * d6 - d5 * d4;
  const Scalar sum = of_i + of_j + of_k;
  if (of_k <= 0 || !(sum > 0)) return nearest_on_segment(s, i, j);
  return s.with({{i, of_i / sum}, {j, of_j / sum}, {k, of_k / sum}});
}

// The faces at vertex 3, the newest: the opposite one cannot be nearer than before. All four
// vertices if the origin is on the inner side of each face; if the triangles are known to be apart
// that is rounding, and the nearest face is taken.
GjkSimplex<3> nearest_on_tetrahedron(const GjkSimplex<3>& s, bool is_apart) {
  constexpr int kFaces[3][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}};
  GjkSimplex<3> best = s;
  best.weights = {0.25, 0.25, 0.25, 0.25};
  Scalar best_sq = kInfinity;
  const auto test_faces = [&](bool tests_inner) {
    for (const auto& [i, j, opposite] : kFaces) {
      const Vector3 n = (s.w(i) - s.w(3)).cross(s.w(j) - s.w(3));
      const bool is_inner = n.dot(s.w(opposite) - s.w(3)) * -n.dot(s.w(3)) > 0;
      if (is_inner && !tests_inner) continue;
      const GjkSimplex<3> part = nearest_on_triangle(s, i, j, 3);
      const Scalar squared = part.nearest().squaredNorm();
      if (!(squared < best_sq)) continue;
      best = part;
      best_sq = squared;
    }
  };
  test_faces(false);
  if (best.count == 4 && is_apart) test_faces(true);
  return best;
}

template <int dimension>
GjkSimplex<dimension> nearest_part(const GjkSimplex<dimension>& s, [[maybe_unused]] bool is_apart) {
  switch (s.count) {
    case 1:
      return s.with({{0, 1}});
    case 2:
      return nearest_on_segment(s, 1, 0);
    case 3:
      return nearest_on_triangle(s, 0, 1, 2);
    default:
      if constexpr (dimension == 3) return nearest_on_tetrahedron(s, is_apart);
      return s;
  }
}

template <int dimension>
GjkEstimate<dimension> run_gjk(const GjkTriangle<dimension>& a, const GjkTriangle<dimension>& b) {
  using Point = GjkPoint<dimension>;
  const auto vertex_of = [&](int i, int j) {
    return GjkVertex<dimension>{b[static_cast<std::size_t>(j)] - a[static_cast<std::size_t>(i)], i,
                                j};
  };
  GjkSimplex<dimension> simplex;
  simplex.vertices[0] = vertex_of(0, 0);
  simplex.count = 1;
  Point v = simplex.w(0);
  Scalar norm_sq = v.squaredNorm();
  GjkEstimate<dimension> result;
  while (result.iterations < kTextbookGjkLimit && norm_sq > 0) {
    ++result.iterations;
    const int i = support<dimension>(a, v);
    const int j = support<dimension>(b, -v);
    const GjkVertex<dimension> added = vertex_of(i, j);
    const Scalar reach = v.dot(added.w);  // positive only if they are apart
    if (norm_sq - reach <= kTextbookGjkConvergence * norm_sq) break;
    if (simplex.contains(i, j)) break;
    GjkSimplex<dimension> next = simplex;
    next.vertices[static_cast<std::size_t>(next.count++)] = added;
    next = nearest_part(next, reach > 0);
    if (next.count == dimension + 1) {
      simplex = next;
      result.is_overlapping = true;
      break;
    }
    const Point nearer = next.nearest();
    const Scalar nearer_sq = nearer.squaredNorm();
    if (!(nearer_sq < norm_sq)) break;  // rounding: no progress
    simplex = next;
    v = nearer;
    norm_sq = nearer_sq;
  }
  result.is_overlapping = result.is_overlapping || norm_sq == 0;
  result.distance = result.is_overlapping ? 0 : std::sqrt(norm_sq);
  for (std::size_t k = 0; k < static_cast<std::size_t>(simplex.count); ++k) {
    const auto& vertex = simplex.vertices[k];
    result.p_a += simplex.weights[k] * a[static_cast<std::size_t>(vertex.a)];
    result.p_b += simplex.weights[k] * b[static_cast<std::size_t>(vertex.b)];
  }
  return result;
}

}  // namespace

GjkEstimate<2> textbook_gjk(const PlanarTriangle& a, const PlanarTriangle& b) {
  return run_gjk<2>(a, b);
}

GjkEstimate<3> textbook_gjk(const Triangle& a, const Triangle& b) {
  return run_gjk<3>(a, b);
}

}  // namespace dyop
