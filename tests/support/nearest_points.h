// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>

#include "support/inputs/quad.h"

/// The nearest points of two triangles straight from the definition, in any field of numbers:
/// double, Quad, or exact rationals. Every candidate is a pair of points of the triangles, so that
/// rounding can only miss the minimum, never undercut it.
namespace dyop::testing {

template <typename Number>
struct Point {
  Number x{};
  Number y{};
  Number z{};

  friend Point operator+(const Point& p, const Point& q) {
    return {Number(p.x + q.x), Number(p.y + q.y), Number(p.z + q.z)};
  }
  friend Point operator-(const Point& p, const Point& q) {
    return {Number(p.x - q.x), Number(p.y - q.y), Number(p.z - q.z)};
  }
  friend Point operator*(const Number& s, const Point& p) {
    return {Number(s * p.x), Number(s * p.y), Number(s * p.z)};
  }
};

template <typename Number>
using PointTriangle = std::array<Point<Number>, 3>;

template <typename Number>
Number dot(const Point<Number>& p, const Point<Number>& q) {
  return Number(p.x * q.x + p.y * q.y + p.z * q.z);
}

template <typename Number>
Point<Number> cross(const Point<Number>& p, const Point<Number>& q) {
  return {Number(p.y * q.z - p.z * q.y), Number(p.z * q.x - p.x * q.z),
          Number(p.x * q.y - p.y * q.x)};
}

/// A point of A, a point of B, and the square of their distance.
template <typename Number>
struct NearestPair {
  Point<Number> on_a;
  Point<Number> on_b;
  Number squared_distance;

  void keep_nearer(const Point<Number>& p, const Point<Number>& q) {
    const Point<Number> step = q - p;
    const Number squared = dot(step, step);
    if (squared < squared_distance) *this = {p, q, squared};
  }
};

template <typename Number>
Point<Number> nearest_on_segment(const Point<Number>& p, const Point<Number>& a,
                                 const Point<Number>& b) {
  const Point<Number> edge = b - a;
  const Number length_sq = dot(edge, edge);
  if (!(length_sq > 0)) return a;
  const Number t = dot(p - a, edge) / length_sq;
  if (t <= 0) return a;
  if (t >= 1) return b;
  return a + t * edge;
}

/// The projection on the plane if it lies in the triangle; nothing for a triangle without area.
template <typename Number>
std::optional<Point<Number>> projection_in_triangle(const Point<Number>& p,
                                                    const PointTriangle<Number>& triangle) {
  const Point<Number> e = triangle[1] - triangle[0];
  const Point<Number> f = triangle[2] - triangle[0];
  const Point<Number> w = p - triangle[0];
  const Point<Number> n = cross(e, f);
  const Number n_sq = dot(n, n);
  if (!(n_sq > 0)) return std::nullopt;
  const Number s = dot(cross(w, f), n) / n_sq;
  const Number t = dot(cross(e, w), n) / n_sq;
  if (s < 0 || t < 0 || s + t > 1) return std::nullopt;
  return triangle[0] + s * e + t * f;
}

template <typename Number>
Point<Number> nearest_on_triangle(const Point<Number>& p, const PointTriangle<Number>& triangle) {
  const Point<Number> step = triangle[0] - p;
  NearestPair<Number> best{p, triangle[0], dot(step, step)};
  for (std::size_t k = 0; k < 3; ++k) {
    best.keep_nearer(p, nearest_on_segment(p, triangle[k], triangle[(k + 1) % 3]));
  }
  const auto projection = projection_in_triangle(p, triangle);
  if (projection) best.keep_nearer(p, *projection);
  return best.on_b;
}

/// Feet of the common perpendicular of two segments' lines, where both lie in the segments.
template <typename Number>
void keep_perpendicular(NearestPair<Number>& best, const Point<Number>& a0, const Point<Number>& a1,
                        const Point<Number>& b0, const Point<Number>& b1) {
  const Point<Number> e = a1 - a0;
  const Point<Number> f = b1 - b0;
  const Point<Number> w = b0 - a0;
  const Point<Number> n = cross(e, f);
  const Number n_sq = dot(n, n);
  if (!(n_sq > 0)) return;
  const Number s = dot(cross(w, f), n) / n_sq;
  const Number t = dot(cross(w, e), n) / n_sq;
  if (s < 0 || s > 1 || t < 0 || t > 1) return;
  best.keep_nearer(a0 + s * e, b0 + t * f);
}

/// Where the segment meets the triangle's plane, if its ends lie on different sides.
template <typename Number>
std::optional<Point<Number>> plane_crossing(const Point<Number>& p, const Point<Number>& q,
                                            const PointTriangle<Number>& triangle) {
  const Point<Number> n = cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
  const Number height_p = dot(n, p - triangle[0]);
  const Number height_q = dot(n, q - triangle[0]);
  const bool is_overlapping = (height_p < 0 && height_q > 0) || (height_p > 0 && height_q < 0);
  if (!is_overlapping) return std::nullopt;
  const Number t = height_p / Number(height_p - height_q);
  return p + t * (q - p);
}

/// Minimum over six vertex-triangle pairs (with the triangle's border, so that all ends of edges
/// against edges are in it), nine edge-edge pairs, and six edges piercing the other triangle. Two
/// triangles that meet do so at a point of an edge of one of them, so this is all.
template <typename Number>
NearestPair<Number> nearest_points(const PointTriangle<Number>& a, const PointTriangle<Number>& b) {
  const Point<Number> step = b[0] - a[0];
  NearestPair<Number> best{a[0], b[0], dot(step, step)};
  for (std::size_t i = 0; i < 3; ++i) {
    best.keep_nearer(a[i], nearest_on_triangle(a[i], b));
    best.keep_nearer(nearest_on_triangle(b[i], a), b[i]);
    const std::size_t next = (i + 1) % 3;
    for (std::size_t j = 0; j < 3; ++j) {
      keep_perpendicular(best, a[i], a[next], b[j], b[(j + 1) % 3]);
    }
    const auto of_a = plane_crossing(a[i], a[next], b);
    if (of_a) best.keep_nearer(*of_a, nearest_on_triangle(*of_a, b));
    const auto of_b = plane_crossing(b[i], b[next], a);
    if (of_b) best.keep_nearer(nearest_on_triangle(*of_b, a), *of_b);
  }
  return best;
}

/// Width of the slab between the triangles perpendicular to the line through the nearest points:
/// it cannot exceed their distance, whatever the points are. Zero or negative proves nothing.
template <typename Number>
Number slab_gap(const PointTriangle<Number>& a, const PointTriangle<Number>& b,
                const NearestPair<Number>& nearest) {
  const Point<Number> n = nearest.on_b - nearest.on_a;
  const Number norm = square_root(dot(n, n));
  if (!(norm > 0)) return 0;
  Number a_max = dot(n, a[0] - nearest.on_a);
  Number b_min = dot(n, b[0] - nearest.on_a);
  for (std::size_t k = 1; k < 3; ++k) {
    a_max = std::max(a_max, dot(n, a[k] - nearest.on_a));
    b_min = std::min(b_min, dot(n, b[k] - nearest.on_a));
  }
  return (b_min - a_max) / norm;
}

}  // namespace dyop::testing
