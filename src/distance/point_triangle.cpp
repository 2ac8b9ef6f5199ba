// SPDX-License-Identifier: BSD-3-Clause
#include "distance/point_triangle.h"

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"
#include "dyop/distance/triangle_distance.h"

namespace dyop::distance_internal {
namespace {

// The weights of vertices 1 and 2 at the nearest point, and the feature it lies on.
struct Place {
  Scalar s = 0;
  Scalar t = 0;
  Feature feature{FeatureKind::Vertex, {0}};
};

// The place of the nearest point of a triangle with the edges e1 and e2 from vertex 0, which is at
// r from the point: by the Voronoi regions of its features ([Ericson2005] 5.1.5).
Place find_place(const Vector3& r, const Vector3& e1, const Vector3& e2) {
  const Scalar d1 = -e1.dot(r);
  const Scalar d2 = -e2.dot(r);
  if (d1 <= 0 && d2 <= 0) return {};
  const Vector3 r1 = r + e1;
  const Scalar d3 = -e1.dot(r1);
  const Scalar d4 = -e2.dot(r1);
  if (d3 >= 0 && d4 <= d3) return {1, 0, {FeatureKind::Vertex, {1}}};
  const Vector3 r2 = r + e2;
  const Scalar d5 = -e1.dot(r2);
  const Scalar d6 = -e2.dot(r2);
  if (d6 >= 0 && d5 <= d6) return {0, 1, {FeatureKind::Vertex, {2}}};
  const Scalar vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    return {d1 / (d1 - d3), 0, {FeatureKind::Edge, {0, 1}}};
  }
  const Scalar vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    return {0, d2 / (d2 - d6), {FeatureKind::Edge, {0, 2}}};
  }
  const Scalar va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) {
    const Scalar t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {1 - t, t, {FeatureKind::Edge, {1, 2}}};
  }
  const Scalar sum = va + vb + vc;
  const Scalar s = vb / sum;
  return {s, std::min(vc / sum, 1 - s), {FeatureKind::Face, {0, 1, 2}}};
}

// The direction from the point that should prove the distance; any length. Perpendicular to the
// feature, because rounding of the witness would tilt it.
Vector3 direction_of(const Place& place, const Vector3& r, const Vector3& e1, const Vector3& e2,
                     const Vector3& D) {
  switch (place.feature.kind) {
    case FeatureKind::Face: {
      const Vector3 n = e1.cross(e2);
      return n.dot(r) >= 0 ? n : Vector3(-n);
    }
    case FeatureKind::Edge: {
      const auto& ends = place.feature.vertices;
      const Vector3 edge = ends[0] == 1 ? Vector3(e2 - e1) : (ends[1] == 1 ? e1 : e2);
      return D - edge * (edge.dot(D) / edge.squaredNorm());
    }
    case FeatureKind::Vertex:
    case FeatureKind::Smooth:
      break;
  }
  return D;
}

PointTriangleDistance by_triangles(const Vector3& p, const Triangle& triangle) {
  const TriangleDistance kernel = triangle_distance({p, p, p}, triangle);
  return {kernel.lower, kernel.upper, kernel.p_b, -kernel.nhat_AB, kernel.feature_b};
}

}  // namespace

PointTriangleDistance point_triangle_distance(const Vector3& p, const Triangle& triangle) {
  const Vector3 r = triangle[0] - p;
  const Vector3 e1 = triangle[1] - triangle[0];
  const Vector3 e2 = triangle[2] - triangle[0];
  // At least |r| plus the longest edge.
  const Scalar size = r.norm() + e1.norm() + e2.norm();
  // NaN and infinity take the slow path too.
  if (!(size >= kSmallestTriangleSize && size <= kLargestTriangleSize)) {
    return by_triangles(p, triangle);
  }
  const Place place = find_place(r, e1, e2);
  const Vector3 along = place.s * e1 + place.t * e2;
  const Vector3 D = r + along;
  const Vector3 m = direction_of(place, r, e1, e2, D);
  const Scalar norm_sq = m.squaredNorm();
  if (!(norm_sq > kSmallestSquaredDirection)) return by_triangles(p, triangle);
  // The operations of prove() in triangle_pair.h, with a point for A: the same slack covers them.
  const Scalar norm = std::sqrt(norm_sq);
  const Scalar gap = (m.dot(r) + std::min(0.0, std::min(m.dot(e1), m.dot(e2)))) / norm;
  const Scalar length = D.norm();
  const Scalar size_slack = kTriangleSizeSlack * size;
  PointTriangleDistance result;
  result.lower = std::max(0.0, gap - (kTriangleRelativeSlack * std::abs(gap) + size_slack));
  result.upper = length + (kTriangleRelativeSlack * length + size_slack);
  // Also if the weights are NaN, or not those of a point of the triangle.
  if (!(result.upper - result.lower <= kTriangleNoise * size)) return by_triangles(p, triangle);
  result.p_C = triangle[0] + along;
  result.nhat_C = m / -norm;
  result.feature = place.feature;
  return result;
}

}  // namespace dyop::distance_internal
