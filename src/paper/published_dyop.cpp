// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/paper/published_dyop.h"

#include <algorithm>

// The seven steps of Figure 1 of [DyOP], in its order. The paper has them in the plane; here each
// is written for any dimension, which is the direct extension to three.
namespace dyop {
namespace {

template <int dimension>
using PointOf = typename PublishedDyop<dimension>::Point;

template <int dimension>
using TriangleOf = std::array<PointOf<dimension>, 3>;

// Step 1: the axis-aligned box of a triangle.
template <int dimension>
typename PublishedDyop<dimension>::Box box_of(const TriangleOf<dimension>& triangle) {
  return {triangle[0].cwiseMin(triangle[1]).cwiseMin(triangle[2]),
          triangle[0].cwiseMax(triangle[1]).cwiseMax(triangle[2])};
}

// Steps 2 to 5: axis of movement, facing extremes, internal box, pivot.
template <int dimension>
void find_pivot(PublishedDyop<dimension>& result) {
  using Point = PointOf<dimension>;
  // Step 3: along each axis the facing extremes are the larger of the two minima and the smaller of
  // the two maxima. The paper names them by the sides of its figure: X_P and X_C, Y_Q and Y_A.
  const Point inner_min = result.box_a.min().cwiseMax(result.box_b.min());
  const Point inner_max = result.box_a.max().cwiseMin(result.box_b.max());
  // Step 2: the axis of movement. The paper takes it from the objects' approach; two triangles at
  // rest approach along the axis with the widest gap. The formulas below do not need it: it is kept
  // because the paper names it and the drawings show it.
  (inner_min - inner_max).maxCoeff(&result.axis);
  // Step 4: the internal box lies between the extremes, whether they leave a gap or overlap.
  result.internal_box = {inner_min.cwiseMin(inner_max), inner_min.cwiseMax(inner_max)};
  // Step 5: X = (X_P + X_C) / 2, Y = (Y_Q + Y_A) / 2.
  result.pivot = (inner_min + inner_max) / 2;
}

// Step 6: the two vertices nearest to the pivot. Of equally far ones the one with the smaller
// number is kept: the paper leaves this open.
template <int dimension>
std::array<int, 2> kept_vertices(const TriangleOf<dimension>& triangle,
                                 const PointOf<dimension>& pivot) {
  const Scalar d0 = (triangle[0] - pivot).squaredNorm();
  const Scalar d1 = (triangle[1] - pivot).squaredNorm();
  const Scalar d2 = (triangle[2] - pivot).squaredNorm();
  const int farther = static_cast<int>(d1 >= d0);
  const int dropped = d2 >= std::max(d0, d1) ? 2 : farther;
  static constexpr std::array<std::array<int, 2>, 3> kKept{{{1, 2}, {0, 2}, {0, 1}}};
  return kKept[static_cast<std::size_t>(dropped)];
}

// The two kept edges: a[0] + s e and b[0] + t f for s, t in [0, 1], and r = b[0] - a[0].
template <int dimension>
struct KeptEdges {
  std::array<PointOf<dimension>, 2> a;
  std::array<PointOf<dimension>, 2> b;
  PointOf<dimension> e = a[1] - a[0];
  PointOf<dimension> f = b[1] - b[0];
  PointOf<dimension> r = b[0] - a[0];
  Scalar ee = e.squaredNorm();
  Scalar ff = f.squaredNorm();
  Scalar ef = e.dot(f);
  Scalar er = e.dot(r);
  Scalar fr = f.dot(r);
};

// Candidates for the shortest segment: parameters and squared length. In arrays, and the shortest
// is picked without branches, which processors would mispredict for random triangles.
struct Candidates {
  std::array<Scalar, 5> s;
  std::array<Scalar, 5> t;
  std::array<Scalar, 5> length_sq;

  std::size_t shortest() const {
    std::size_t best = 0;
    Scalar smallest = length_sq[0];
    for (std::size_t k = 1; k < 5; ++k) {
      best = length_sq[k] < smallest ? k : best;
      smallest = length_sq[k] < smallest ? length_sq[k] : smallest;
    }
    return best;
  }
};

// Clamped to the edge, whose ends are the vertex-vertex tests; 0 for an edge without length.
Scalar along_edge(Scalar parameter) {
  const Scalar positive = parameter > 0 ? parameter : 0;
  return positive < 1 ? positive : 1;
}

// Step 7: vertex-vertex, vertex-edge and edge-edge distances of the kept edges; the shortest wins.
template <int dimension>
Candidates test_kept(const KeptEdges<dimension>& k) {
  // Vertex-edge, with vertex-vertex as its limits: the ends of a's edge, then those of b's.
  const Scalar determinant = k.ee * k.ff - k.ef * k.ef;
  const Scalar s_crossing = (k.ff * k.er - k.ef * k.fr) / determinant;
  const Scalar t_crossing = (k.ef * k.er - k.ee * k.fr) / determinant;
  // Edge-edge: the common perpendicular of the lines, in the plane their crossing point, if it is
  // on both edges. Not for parallel edges, where the division gives NaN or infinity.
  const bool is_on_both = s_crossing >= 0 && s_crossing <= 1 && t_crossing >= 0 && t_crossing <= 1;
  Candidates found;
  found.s = {0, 1, along_edge(k.er / k.ee), along_edge((k.er + k.ef) / k.ee),
             is_on_both ? s_crossing : 0};
  found.t = {along_edge(-k.fr / k.ff), along_edge((k.ef - k.fr) / k.ff), 0, 1,
             is_on_both ? t_crossing : 0};
  for (std::size_t c = 0; c < 5; ++c) {
    found.length_sq[c] = (k.r + found.t[c] * k.f - found.s[c] * k.e).squaredNorm();
  }
  return found;
}

Feature kept_feature(const std::array<int, 2>& kept, Scalar parameter) {
  if (parameter == 0) return {FeatureKind::Vertex, {kept[0]}};
  if (parameter == 1) return {FeatureKind::Vertex, {kept[1]}};
  return {FeatureKind::Edge, {kept[0], kept[1]}};
}

template <int dimension>
std::array<PointOf<dimension>, 2> points_of(const TriangleOf<dimension>& triangle,
                                            const std::array<int, 2>& kept) {
  return {triangle[static_cast<std::size_t>(kept[0])], triangle[static_cast<std::size_t>(kept[1])]};
}

template <int dimension>
PublishedDyop<dimension> run_steps(const TriangleOf<dimension>& a, const TriangleOf<dimension>& b) {
  PublishedDyop<dimension> result;
  result.box_a = box_of<dimension>(a);
  result.box_b = box_of<dimension>(b);
  find_pivot(result);
  result.kept_a = kept_vertices<dimension>(a, result.pivot);
  result.kept_b = kept_vertices<dimension>(b, result.pivot);
  const KeptEdges<dimension> kept{points_of<dimension>(a, result.kept_a),
                                  points_of<dimension>(b, result.kept_b)};
  const Candidates found = test_kept(kept);
  const std::size_t shortest = found.shortest();
  const Scalar s = found.s[shortest];
  const Scalar t = found.t[shortest];
  result.p_a = s < 1 ? PointOf<dimension>(kept.a[0] + s * kept.e) : kept.a[1];
  result.p_b = t < 1 ? PointOf<dimension>(kept.b[0] + t * kept.f) : kept.b[1];
  result.feature_a = kept_feature(result.kept_a, s);
  result.feature_b = kept_feature(result.kept_b, t);
  result.distance = std::sqrt(found.length_sq[shortest]);
  return result;
}

}  // namespace

PublishedDyop<2> published_dyop(const PlanarTriangle& a, const PlanarTriangle& b) {
  return run_steps<2>(a, b);
}

PublishedDyop<3> published_dyop(const Triangle& a, const Triangle& b) {
  return run_steps<3>(a, b);
}

}  // namespace dyop
