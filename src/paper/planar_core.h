// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include "core/tolerance.h"
#include "dyop/paper/planar_distance.h"

// Shared by the planar algorithms: witnesses, and the proof that bounds the distance with them.
//
// Rounding. u = 2^-53. D is the width plus the height of the box around both; no two points of the
// pair are farther apart. A difference of vertices errs by u in each component, a scalar product of
// two components by 2u |m||x| [JeannerodRump2013], so each side of a slab gap errs by 3u |m| D, the
// gap by 6u |m| D and its own subtraction; the norm, the division and the final operations add below
// 8u of the gap. With kTriangleRelativeSlack = 8u of the value and kTriangleSizeSlack = 7u D taken
// off, `lower` is below the true slab gap. The segment found is r - t e, with r and e single
// differences: 3u D and u of its length; the norm adds 2u, the final operations 2u: the same two
// slacks cover `upper`. A direction with |m|^2 < 2^-900 proves nothing, which keeps underflow
// (2^-1075 per product) far below the slack. A smaller square is replaced by the sum of the
// components, so that `upper` cannot underflow either. NaN makes D NaN; then nothing is proven.
// planar_noise() is 64u D: the slacks take 30u, the rest is the rounding of the witness itself.
namespace dyop::paper_internal {

inline Scalar cross(const Vector2& u, const Vector2& v) {
  return u.x() * v.y() - u.y() * v.x();
}

// The vector rotated clockwise by a quarter turn: outward for an edge of a counterclockwise
// polygon.
inline Vector2 rotated_clockwise(const Vector2& v) {
  return {v.y(), -v.x()};
}

template <typename Polygon>
std::size_t after(const Polygon& polygon, std::size_t k) {
  return k + 1 == polygon.size() ? 0 : k + 1;
}

// Width plus height of the box around both: no two points are farther apart. NaN if a coordinate is
// NaN or infinite, because a sum keeps NaN, which a maximum may lose.
template <typename PolygonA, typename PolygonB>
Scalar planar_size(const PolygonA& a, const PolygonB& b) {
  Vector2 low = a[0];
  Vector2 high = a[0];
  Scalar sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    low = low.cwiseMin(a[k]);
    high = high.cwiseMax(a[k]);
    sum += a[k].sum();
  }
  for (std::size_t k = 0; k < b.size(); ++k) {
    low = low.cwiseMin(b[k]);
    high = high.cwiseMax(b[k]);
    sum += b[k].sum();
  }
  return (high - low).sum() + 0 * sum;
}

// A point of each side and how they were found: two vertices, or a vertex and an inner point of an
// edge.
struct PlanarWitness {
  Vector2 w = Vector2::Zero();  // from a to b, computed from differences of vertices
  Vector2 m = Vector2::Zero();  // direction of the proof, not unit
  Scalar length_sq = kInfinity;
  Vector2 p_a = Vector2::Zero();
  Vector2 p_b = Vector2::Zero();
  Feature feature_a;
  Feature feature_b;
  Vector2 to_start = Vector2::Zero();  // between the vertex and the ends of the edge, from a to b
  Vector2 to_end = Vector2::Zero();
};

inline Feature planar_vertex(std::size_t k) {
  return {FeatureKind::Vertex, {static_cast<std::int32_t>(k)}};
}

inline Feature planar_edge(std::size_t k, std::size_t next) {
  return {FeatureKind::Edge, {static_cast<std::int32_t>(k), static_cast<std::int32_t>(next)}};
}

inline PlanarWitness swapped(const PlanarWitness& x) {
  return {-x.w, -x.m, x.length_sq, x.p_b, x.p_a, x.feature_b, x.feature_a, -x.to_start, -x.to_end};
}

// Edge k of a against vertex j of b, clamped to the edge.
template <typename PolygonA, typename PolygonB>
PlanarWitness edge_vertex_witness(const PolygonA& a, std::size_t k, const PolygonB& b,
                                  std::size_t j) {
  const std::size_t next = after(a, k);
  const Vector2 e = a[next] - a[k];
  const Vector2 r = b[j] - a[k];
  const Scalar along = r.dot(e);
  const Scalar length_sq = e.squaredNorm();
  PlanarWitness result;
  result.p_b = b[j];
  result.feature_b = planar_vertex(j);
  result.to_start = r;
  result.to_end = b[j] - a[next];
  if (along > 0 && along < length_sq) {
    const Vector2 step = (along / length_sq) * e;
    result.w = r - step;
    result.m = rotated_clockwise(e);
    if (result.m.dot(result.w) < 0) result.m = -result.m;
    result.p_a = a[k] + step;
    result.feature_a = planar_edge(k, next);
  } else {
    const std::size_t end = along > 0 ? next : k;
    result.w = b[j] - a[end];
    result.m = result.w;
    result.p_a = a[end];
    result.feature_a = planar_vertex(end);
  }
  result.length_sq = result.w.squaredNorm();
  return result;
}

// Slab gap along m times |m|, relative to a point near the pair.
template <typename PolygonA, typename PolygonB>
Scalar planar_gap(const PolygonA& a, const PolygonB& b, const Vector2& origin, const Vector2& m) {
  Scalar high_a = -kInfinity;
  Scalar low_b = kInfinity;
  for (std::size_t k = 0; k < a.size(); ++k) high_a = std::max(high_a, m.dot(a[k] - origin));
  for (std::size_t k = 0; k < b.size(); ++k) low_b = std::min(low_b, m.dot(b[k] - origin));
  return low_b - high_a;
}

// Sets the bounds and the normal from the vector w between two witness points and the direction m
// with its planar_gap(). NaN anywhere leaves lower at 0.
inline void prove_bounds(PlanarDistance& result, const Vector2& w, const Vector2& m, Scalar size,
                         Scalar scaled_gap) {
  const Scalar slack = kTriangleSizeSlack * size;
  const Scalar length_sq = w.squaredNorm();
  // Squares below the smallest safe one may have underflowed; the sum of the components never does.
  const Scalar length =
      length_sq >= kSmallestSquaredDirection ? std::sqrt(length_sq) : w.cwiseAbs().sum();
  result.upper = length + kTriangleRelativeSlack * length + slack;
  const Scalar norm_sq = m.squaredNorm();
  if (!(norm_sq >= kSmallestSquaredDirection)) return;  // proves nothing
  const Scalar norm = std::sqrt(norm_sq);
  const Scalar gap = scaled_gap / norm;
  const Scalar lower = gap - kTriangleRelativeSlack * gap - slack;
  if (lower > 0) result.lower = lower;
  result.nhat_AB = m / norm;
}

template <typename PolygonA, typename PolygonB>
PlanarDistance proven_distance(const PolygonA& a, const PolygonB& b, Scalar size,
                               const PlanarWitness& x) {
  PlanarDistance result;
  prove_bounds(result, x.w, x.m, size, planar_gap(a, b, x.p_a, x.m));
  result.p_a = x.p_a;
  result.p_b = x.p_b;
  result.feature_a = x.feature_a;
  result.feature_b = x.feature_b;
  return result;
}

// Proven apart, and the bounds agree. False for NaN.
inline bool is_certified(const PlanarDistance& d, Scalar size) {
  return d.lower > 0 && d.upper - d.lower <= kTriangleNoise * size;
}

// convex_polygon_distance() without the check, for callers whose own answer is not certified.
PlanarDistance resolve_polygons(std::span<const Vector2> a, std::span<const Vector2> b);

}  // namespace dyop::paper_internal
