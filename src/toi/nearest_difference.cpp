// SPDX-License-Identifier: BSD-3-Clause
#include "toi/nearest_difference.h"

#include <algorithm>

namespace dyop::toi_internal {
namespace {

// literal: squared sine below which a cross product of two sides is rounding, about 1e-16 of them.
constexpr Scalar kSmallestSineSquare = 1e-28;

// The component of x perpendicular to an edge.
Vector3 reject(const Vector3& x, const Vector3& edge) {
  const Scalar length_sq = edge.squaredNorm();
  return length_sq > 0 ? Vector3(x - (x.dot(edge) / length_sq) * edge) : x;
}

Vector3 towards(const Vector3& normal, const Vector3& point) {
  return normal.dot(point) < 0 ? Vector3(-normal) : normal;
}

Feature vertex_feature(std::int32_t i) {
  return {FeatureKind::Vertex, {i}};
}

Feature edge_feature(std::int32_t i, std::int32_t j) {
  return {FeatureKind::Edge, {i, j}};
}

NearestDifference<3> at_corner(const Differences<3>& corners, std::size_t i) {
  NearestDifference<3> nearest;
  nearest.weights[i] = 1;
  nearest.point = corners[i];
  nearest.normal = corners[i];
  nearest.feature_a = vertex_feature(0);
  nearest.feature_b = vertex_feature(static_cast<std::int32_t>(i));
  return nearest;
}

// The origin's foot on the side from corner i to corner j has the parameter `before` / (`before` +
// `after`).
NearestDifference<3> on_side(const Differences<3>& corners, std::size_t i, std::size_t j,
                             Scalar before, Scalar after) {
  const Scalar length = before + after;
  if (!(length > 0)) return at_corner(corners, i);
  NearestDifference<3> nearest;
  nearest.weights[i] = after / length;
  nearest.weights[j] = before / length;
  nearest.point = nearest.weights[i] * corners[i] + nearest.weights[j] * corners[j];
  nearest.normal = reject(nearest.point, corners[j] - corners[i]);
  nearest.feature_a = vertex_feature(0);
  nearest.feature_b = edge_feature(static_cast<std::int32_t>(i), static_cast<std::int32_t>(j));
  return nearest;
}

// The best parameter in [0, 1] of p + t edge, for the distance from the origin.
Scalar clamped_foot(const Vector3& p, const Vector3& edge) {
  const Scalar length_sq = edge.squaredNorm();
  return length_sq > 0 ? std::clamp(-p.dot(edge) / length_sq, 0.0, 1.0) : 0.0;
}

NearestDifference<3> nearest_side(const Differences<3>& corners) {
  NearestDifference<3> best;
  Scalar best_sq = kInfinity;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const std::size_t j = (i + 1) % corners.size();
    const Scalar foot = clamped_foot(corners[i], corners[j] - corners[i]);
    const NearestDifference<3> nearest = foot <= 0   ? at_corner(corners, i)
                                         : foot >= 1 ? at_corner(corners, j)
                                                     : on_side(corners, i, j, foot, 1 - foot);
    const Scalar distance_sq = nearest.point.squaredNorm();
    if (!(distance_sq < best_sq)) continue;
    best_sq = distance_sq;
    best = nearest;
  }
  return best;
}

struct EdgeParameters {
  Scalar s;
  Scalar t;
};

// The best of the four pairs of an end and an edge; for parallel edges that is sufficient.
EdgeParameters nearest_end(const Differences<4>& corners, const Vector3& u, const Vector3& v) {
  const std::array<EdgeParameters, 4> ends{{{0, clamped_foot(corners[0], v)},
                                            {1, clamped_foot(corners[2], v)},
                                            {clamped_foot(corners[0], -u), 0},
                                            {clamped_foot(corners[1], -u), 1}}};
  const auto distance_sq = [&](const EdgeParameters& end) {
    return (corners[0] + end.t * v - end.s * u).squaredNorm();
  };
  return *std::min_element(ends.begin(), ends.end(), [&](const auto& x, const auto& y) {
    return distance_sq(x) < distance_sq(y);
  });
}

// Minimises |r + t v - s u|, r = b0 - a0, over the unit square: first without bounds on t, then
// with s given, then with t given. The cross product keeps its digits where the Gram determinant of
// nearly parallel edges has none.
EdgeParameters nearest_parameters(const Differences<4>& corners, const Vector3& u,
                                  const Vector3& v) {
  const Vector3& r = corners[0];
  const Vector3 normal = u.cross(v);
  const Scalar normal_sq = normal.squaredNorm();
  const Scalar uu = u.squaredNorm();
  const Scalar vv = v.squaredNorm();
  if (!(normal_sq > kSmallestSineSquare * uu * vv)) return nearest_end(corners, u, v);
  const Scalar s = std::clamp(r.cross(v).dot(normal) / normal_sq, 0.0, 1.0);
  const Scalar t = std::clamp((s * u - r).dot(v) / vv, 0.0, 1.0);
  return {std::clamp((r + t * v).dot(u) / uu, 0.0, 1.0), t};
}

}  // namespace

// Voronoi regions of vertices, edges and face in turn ([Ericson2005]); for a triangle without area,
// the nearest side.
NearestDifference<3> find_nearest(const Differences<3>& corners) {
  const Vector3 side_b = corners[1] - corners[0];
  const Vector3 side_c = corners[2] - corners[0];
  const Vector3 normal = side_b.cross(side_c);
  const Scalar sides_sq = side_b.squaredNorm() * side_c.squaredNorm();
  if (!(normal.squaredNorm() > kSmallestSineSquare * sides_sq)) return nearest_side(corners);
  // How far along both sides the origin lies, from each corner.
  const Scalar b0 = -side_b.dot(corners[0]);
  const Scalar c0 = -side_c.dot(corners[0]);
  if (b0 <= 0 && c0 <= 0) return at_corner(corners, 0);
  const Scalar b1 = -side_b.dot(corners[1]);
  const Scalar c1 = -side_c.dot(corners[1]);
  if (b1 >= 0 && c1 <= b1) return at_corner(corners, 1);
  const Scalar area_c = normal.dot(corners[0].cross(corners[1]));
  if (area_c <= 0 && b0 >= 0 && b1 <= 0) return on_side(corners, 0, 1, b0, -b1);
  const Scalar b2 = -side_b.dot(corners[2]);
  const Scalar c2 = -side_c.dot(corners[2]);
  if (c2 >= 0 && b2 <= c2) return at_corner(corners, 2);
  const Scalar area_b = normal.dot(corners[2].cross(corners[0]));
  if (area_b <= 0 && c0 >= 0 && c2 <= 0) return on_side(corners, 0, 2, c0, -c2);
  const Scalar area_a = normal.dot(corners[1].cross(corners[2]));
  if (area_a <= 0 && c1 >= b1 && b2 >= c2) return on_side(corners, 1, 2, c1 - b1, b2 - c2);

  // Rounding may leave one of them below zero, but the point must be in the triangle.
  const Scalar part_a = std::max(area_a, 0.0);
  const Scalar part_b = std::max(area_b, 0.0);
  const Scalar part_c = std::max(area_c, 0.0);
  const Scalar area = part_a + part_b + part_c;
  if (!(area > 0)) return nearest_side(corners);
  NearestDifference<3> nearest;
  nearest.weights = {part_a / area, part_b / area, part_c / area};
  nearest.point = nearest.weights[0] * corners[0] + nearest.weights[1] * corners[1] +
                  nearest.weights[2] * corners[2];
  nearest.normal = towards(normal, corners[0]);
  nearest.feature_a = vertex_feature(0);
  nearest.feature_b = {FeatureKind::Face, {0, 1, 2}};
  return nearest;
}

NearestDifference<4> find_nearest(const Differences<4>& corners) {
  const Vector3 u = corners[0] - corners[2];
  const Vector3 v = corners[1] - corners[0];
  const auto [s, t] = nearest_parameters(corners, u, v);
  NearestDifference<4> nearest;
  nearest.weights = {(1 - s) * (1 - t), (1 - s) * t, s * (1 - t), s * t};
  nearest.point = corners[0] + t * v - s * u;
  const bool is_inside_a = s > 0 && s < 1;
  const bool is_inside_b = t > 0 && t < 1;
  nearest.feature_a = is_inside_a ? edge_feature(0, 1) : vertex_feature(s > 0 ? 1 : 0);
  nearest.feature_b = is_inside_b ? edge_feature(0, 1) : vertex_feature(t > 0 ? 1 : 0);
  if (is_inside_a && is_inside_b) {
    nearest.normal = towards(u.cross(v), nearest.point);
  } else if (is_inside_a || is_inside_b) {
    nearest.normal = reject(nearest.point, is_inside_a ? u : v);
  } else {
    nearest.normal = nearest.point;
  }
  return nearest;
}

}  // namespace dyop::toi_internal
