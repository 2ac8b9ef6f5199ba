// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/paper/planar_distance.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <span>

#include "distance/triangle/triangle_pair.h"
#include "dyop/core/error.h"
#include "exact/orientation.h"
#include "paper/planar_core.h"

namespace dyop::paper_internal {

// A common point of two convex polygons and the features that share it; nothing if they are apart,
// or if coordinates differ so much in size that the exact predicates fail (2^200).
struct PlanarCrossing {
  Vector2 point;  // within rounding, unless the edges are parallel up to rounding
  Feature feature_a;
  Feature feature_b;
};

// Decided in exact arithmetic. Cost: all pairs of edges.
std::optional<PlanarCrossing> find_crossing(std::span<const Vector2> a, std::span<const Vector2> b);

}  // namespace dyop::paper_internal

namespace dyop {
namespace paper_internal {
namespace {

// Both triangles side by side: the low lane has a against b, the high lane b against a.
struct SidePair {
  std::array<LanePair, 3> x;
  std::array<LanePair, 3> y;
  Scalar size;  // planar_size()

  SidePair(const PlanarTriangle& a, const PlanarTriangle& b) {
    for (std::size_t k = 0; k < 3; ++k) {
      x[k] = LanePair(a[k].x(), b[k].x());
      y[k] = LanePair(a[k].y(), b[k].y());
    }
    const LanePair width = largest(x) - smallest(x);
    const LanePair height = largest(y) - smallest(y);
    const LanePair sum = ((x[0] + x[1]) + (x[2] + y[0])) + (y[1] + y[2]);
    size = width.low() + height.low() + 0 * (sum.low() + sum.high());
  }

  static LanePair smallest(const std::array<LanePair, 3>& z) {
    const LanePair low = smaller(smaller(z[0], z[1]), z[2]);
    return smaller(low, swapped(low));
  }
  static LanePair largest(const std::array<LanePair, 3>& z) {
    const LanePair high = larger(larger(z[0], z[1]), z[2]);
    return larger(high, swapped(high));
  }
};

// The edge with the largest separation: in the plane the facets of the Minkowski difference are the
// edges of both triangles. All six are scored without a branch; the number of the edge is stored in
// the last four bits of its score. An edge of a triangle without area has no outer side: then
// positive scores are still right, but some may be missing.
struct BestEdge {
  Scalar score = 0;  // square of the separation
  std::size_t edge = 0;
  bool is_of_b = false;

  explicit BestEdge(const SidePair& s) {
    std::array<LanePair, 3> ex, ey;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t next = k == 2 ? 0 : k + 1;
      ex[k] = s.x[next] - s.x[k];
      ey[k] = s.y[next] - s.y[k];
    }
    const LanePair area = ex[0] * ey[1] - ey[0] * ex[1];
    LanePair best(0);
    for (std::size_t k = 0; k < 3; ++k) {
      std::array<LanePair, 3> h;
      for (std::size_t j = 0; j < 3; ++j) {
        h[j] = ey[k] * (swapped(s.x[j]) - s.x[k]) - ex[k] * (swapped(s.y[j]) - s.y[k]);
        h[j] = flip_sign(h[j], area);
      }
      const LanePair low = smaller(smaller(h[0], h[1]), h[2]);
      const LanePair length_sq = ex[k] * ex[k] + ey[k] * ey[k];
      const LanePair square = masked(above(low, LanePair(0)), low * low / length_sq);
      const int code = static_cast<int>(k);
      best = larger(tagged(square, code, code + 4), best);
    }
    score = std::max(best.low(), best.high());
    const auto code = std::bit_cast<std::uint64_t>(score) & 15;
    edge = code & 3;
    is_of_b = (code & 4) != 0;
  }
};

LanePair lanes(const Vector2& v) {
  return {v.x(), v.y()};
}

Scalar planar_dot(LanePair v, LanePair w) {
  const LanePair product = v * w;
  return product.low() + product.high();
}

// One edge against the vertex of the other triangle nearest to its line, clamped. `own` is the
// triangle that has the edge. Vectors are lane pairs (x, y), and no branch depends on the numbers:
// random pairs would mispredict it.
struct EdgeWitness {
  std::size_t edge;
  std::size_t next;
  std::size_t vertex;
  Scalar t;        // parameter along the edge
  LanePair p_own;  // on the edge
  LanePair w;      // from there to the vertex
  LanePair m;      // direction of the proof: the edge's outward normal, or w

  EdgeWitness(std::size_t edge_number, const PlanarTriangle& own, const PlanarTriangle& other)
      : edge(edge_number), next(edge == 2 ? 0 : edge + 1) {
    const LanePair start = lanes(own[edge]);
    const LanePair e = lanes(own[next]) - start;
    const LanePair n = high_negated(swapped(e));
    const Scalar inward = planar_dot(n, lanes(own[3 - edge - next]) - start);
    const LanePair outward = flip_sign(n, LanePair(-inward));
    const std::array<LanePair, 3> r{lanes(other[0]) - start, lanes(other[1]) - start,
                                    lanes(other[2]) - start};
    const std::array<Scalar, 3> h{planar_dot(outward, r[0]), planar_dot(outward, r[1]),
                                  planar_dot(outward, r[2])};
    vertex = static_cast<std::size_t>(h[1] < h[0]);
    const std::size_t is_two = static_cast<std::size_t>(h[2] < smaller(h[1], h[0]));
    vertex += is_two * (2 - vertex);
    const LanePair parameter =
        clamped(LanePair(planar_dot(r[vertex], e)) / LanePair(planar_dot(e, e)));
    t = parameter.low();
    const LanePair step = parameter * e;
    p_own = start + step;
    w = r[vertex] - step;
    m = selected(is_inside_unit(parameter), outward, w);
  }

  Feature own_feature() const {
    const bool is_inner = t > 0 && t < 1;
    return is_inner ? planar_edge(edge, next) : planar_vertex(t < 1 ? edge : next);
  }
};

Vector2 vector_of(LanePair v) {
  return {v.low(), v.high()};
}

// planar_gap() for two triangles, side by side.
Scalar lane_gap(const SidePair& s, const Vector2& origin, const Vector2& m) {
  const LanePair mx = low_negated(LanePair(m.x()));
  const LanePair my = low_negated(LanePair(m.y()));
  const LanePair ox(origin.x());
  const LanePair oy(origin.y());
  std::array<LanePair, 3> h;
  for (std::size_t k = 0; k < 3; ++k) h[k] = mx * (s.x[k] - ox) + my * (s.y[k] - oy);
  const LanePair low = smaller(smaller(h[0], h[1]), h[2]);
  return low.low() + low.high();
}

// The nearest vertex and edge of all, in both orders.
PlanarWitness nearest_of_all(std::span<const Vector2> a, std::span<const Vector2> b) {
  PlanarWitness best;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      const PlanarWitness of_a = edge_vertex_witness(a, i, b, j);
      if (of_a.length_sq < best.length_sq) best = of_a;
      const PlanarWitness of_b = edge_vertex_witness(b, j, a, i);
      if (of_b.length_sq < best.length_sq) best = swapped(of_b);
    }
  }
  return best;
}

// Where rounding decides whether the nearest point is inside an edge or one of its ends, another
// direction may prove more: from vertex to vertex, which is a single difference and accurate to the
// last digit, or perpendicular to an edge.
void try_directions(PlanarDistance& result, std::span<const Vector2> a, std::span<const Vector2> b,
                    Scalar size, PlanarWitness witness) {
  const auto try_direction = [&](const Vector2& m) {
    if (is_certified(result, size)) return;
    witness.m = m.dot(witness.w) < 0 ? Vector2(-m) : m;
    const PlanarDistance other = proven_distance(a, b, size, witness);
    if (other.lower > result.lower) result = other;
  };
  for (const Vector2& m : {witness.w, witness.to_start, witness.to_end}) try_direction(m);
  for (const auto& polygon : {a, b}) {
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      try_direction(rotated_clockwise(polygon[after(polygon, k)] - polygon[k]));
    }
  }
}

}  // namespace

PlanarDistance resolve_polygons(std::span<const Vector2> a, std::span<const Vector2> b) {
  const Scalar size = planar_size(a, b);
  if (!std::isfinite(size)) return {};  // proves nothing
  const PlanarWitness nearest = nearest_of_all(a, b);
  PlanarDistance result = proven_distance(a, b, size, nearest);
  try_directions(result, a, b, size, nearest);
  if (result.lower > 0) return result;
  const auto crossing = find_crossing(a, b);
  if (!crossing) return result;
  // The crossing point is ill-conditioned if the edges are nearly parallel. Then a vertex is within
  // rounding of the other polygon, and a better witness.
  const bool is_at_vertex = result.upper <= kTriangleNoise * size;
  if (!is_at_vertex) {
    result.p_a = result.p_b = crossing->point;
    result.feature_a = crossing->feature_a;
    result.feature_b = crossing->feature_b;
  }
  result.upper = 0;
  result.is_overlapping = true;
  return result;
}

}  // namespace paper_internal

PlanarDistance planar_triangle_distance(const PlanarTriangle& a, const PlanarTriangle& b) {
  using namespace paper_internal;
  const SidePair sides(a, b);
  const BestEdge best(sides);
  if (best.score >= kSmallestSquaredDirection) {
    const PlanarTriangle& own = best.is_of_b ? b : a;
    const PlanarTriangle& other = best.is_of_b ? a : b;
    const EdgeWitness found(best.edge, own, other);
    const LanePair sign(best.is_of_b ? Scalar{-1} : Scalar{1});
    const Vector2 m = vector_of(sign * found.m);
    const Vector2 p_own = vector_of(found.p_own);
    PlanarDistance result;
    prove_bounds(result, vector_of(sign * found.w), m, sides.size, lane_gap(sides, p_own, m));
    (best.is_of_b ? result.p_b : result.p_a) = p_own;
    (best.is_of_b ? result.p_a : result.p_b) = other[found.vertex];
    (best.is_of_b ? result.feature_b : result.feature_a) = found.own_feature();
    (best.is_of_b ? result.feature_a : result.feature_b) = planar_vertex(found.vertex);
    if (is_certified(result, sides.size)) return result;
  }
  return resolve_polygons(a, b);
}

PlanarDistance convex_polygon_distance(std::span<const Vector2> a, std::span<const Vector2> b) {
  DYOP_REQUIRE(!a.empty() && !b.empty(), "a polygon needs a vertex; these have ", a.size(), " and ",
               b.size());
  return paper_internal::resolve_polygons(a, b);
}

Scalar planar_noise(std::span<const Vector2> a, std::span<const Vector2> b) {
  return kTriangleNoise * paper_internal::planar_size(a, b);
}

}  // namespace dyop

namespace dyop::paper_internal {
namespace {

constexpr int kAxis = 2;  // the plane's normal

// Points as the exact predicates require them: scaled by a power of two.
class ExactPlane {
 public:
  ExactPlane(std::span<const Vector2> a, std::span<const Vector2> b) {
    Scalar largest = 0;
    Scalar smallest = kInfinity;
    for (const auto& polygon : {a, b}) {
      for (const Vector2& p : polygon) {
        for (const Scalar x : p) {
          if (x == 0) continue;
          largest = std::max(largest, std::abs(x));
          smallest = std::min(smallest, std::abs(x));
        }
      }
    }
    if (!(largest > 0)) return;  // all at the origin: any scale works
    exponent_ = -1 - std::ilogb(largest);
    is_exact_ = smallest >= largest * kSmallestHullCoordinate * 4;
  }

  // Whether the scaled coordinates are in the range of the predicates.
  bool is_exact() const { return is_exact_; }

  int orientation(const Vector2& p, const Vector2& q, const Vector2& r) const {
    return orientation_along(kAxis, scaled(p), scaled(q), scaled(r));
  }

 private:
  Vector3 scaled(const Vector2& p) const {
    return {std::ldexp(p.x(), exponent_), std::ldexp(p.y(), exponent_), 0};
  }

  int exponent_ = 0;
  bool is_exact_ = true;
};

// For a point on the segment's line.
bool is_between(const Vector2& p, const Vector2& u, const Vector2& v) {
  return (p.array() >= u.cwiseMin(v).array()).all() && (p.array() <= u.cwiseMax(v).array()).all();
}

std::optional<PlanarCrossing> cross_edges(const ExactPlane& plane, std::span<const Vector2> a,
                                          std::size_t i, std::span<const Vector2> b,
                                          std::size_t j) {
  const std::size_t i_next = after(a, i);
  const std::size_t j_next = after(b, j);
  const Vector2& p = a[i];
  const Vector2& q = a[i_next];
  const Vector2& r = b[j];
  const Vector2& s = b[j_next];
  const int side_r = plane.orientation(p, q, r);
  const int side_s = plane.orientation(p, q, s);
  const int side_p = plane.orientation(r, s, p);
  const int side_q = plane.orientation(r, s, q);
  if (side_r * side_s < 0 && side_p * side_q < 0) {
    const Vector2 e = q - p;
    const Vector2 f = s - r;
    // Zero over zero for edges that are parallel up to rounding.
    const Scalar t = clamped(cross(r - p, f) / cross(e, f), 1);
    return PlanarCrossing{p + t * e, planar_edge(i, i_next), planar_edge(j, j_next)};
  }
  if (side_p == 0 && is_between(p, r, s)) {
    return PlanarCrossing{p, planar_vertex(i), planar_edge(j, j_next)};
  }
  if (side_q == 0 && is_between(q, r, s)) {
    return PlanarCrossing{q, planar_vertex(i_next), planar_edge(j, j_next)};
  }
  if (side_r == 0 && is_between(r, p, q)) {
    return PlanarCrossing{r, planar_edge(i, i_next), planar_vertex(j)};
  }
  if (side_s == 0 && is_between(s, p, q)) {
    return PlanarCrossing{s, planar_edge(i, i_next), planar_vertex(j_next)};
  }
  return std::nullopt;
}

// Strictly; a point on the border is found by cross_edges().
bool is_inside(const ExactPlane& plane, const Vector2& p, std::span<const Vector2> polygon) {
  bool has_left = false;
  bool has_right = false;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vector2& q = polygon[after(polygon, k)];
    if (q == polygon[k]) continue;
    const int side = plane.orientation(polygon[k], q, p);
    if (side == 0) return false;
    (side > 0 ? has_left : has_right) = true;
  }
  return has_left != has_right;
}

constexpr Feature kInside{FeatureKind::Face, {0, 1, 2}};

}  // namespace

std::optional<PlanarCrossing> find_crossing(std::span<const Vector2> a,
                                            std::span<const Vector2> b) {
  const ExactPlane plane(a, b);
  if (!plane.is_exact()) return std::nullopt;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      if (const auto crossing = cross_edges(plane, a, i, b, j)) return crossing;
    }
  }
  if (is_inside(plane, a[0], b)) return PlanarCrossing{a[0], planar_vertex(0), kInside};
  if (is_inside(plane, b[0], a)) return PlanarCrossing{b[0], kInside, planar_vertex(0)};
  return std::nullopt;
}

}  // namespace dyop::paper_internal
