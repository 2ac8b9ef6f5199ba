// SPDX-License-Identifier: BSD-3-Clause
#include "paper/planar_crossing.h"

#include <algorithm>
#include <cmath>

#include "distance/triangle/triangle_pair.h"
#include "exact/orientation.h"
#include "paper/planar_core.h"

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
