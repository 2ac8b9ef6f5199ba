// SPDX-License-Identifier: BSD-3-Clause
#include "plain_distance.h"

#include <algorithm>
#include <cmath>

namespace dyop::testing {
namespace {

Scalar clamped(Scalar x) {
  return std::clamp(x, Scalar{0}, Scalar{1});
}

// Squared distance of a point from the segment from p to q.
Scalar point_segment_sq(const Vector3& x, const Vector3& p, const Vector3& q) {
  const Vector3 d = q - p;
  const Scalar length_sq = d.squaredNorm();
  const Scalar t = length_sq > 0 ? clamped((x - p).dot(d) / length_sq) : 0;
  return (x - p - t * d).squaredNorm();
}

// Inside its prism the distance of a point from a triangle is that from the plane.
Scalar point_triangle_sq(const Vector3& x, const Triangle& t) {
  const Vector3 m = (t[1] - t[0]).cross(t[2] - t[0]);
  Scalar least = kInfinity;
  bool is_inside = m.squaredNorm() > 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector3& p = t[i];
    const Vector3& q = t[(i + 1) % 3];
    least = std::min(least, point_segment_sq(x, p, q));
    is_inside = is_inside && m.cross(q - p).dot(x - p) >= 0;
  }
  if (!is_inside) return least;
  const Scalar height = m.dot(x - t[0]);
  return std::min(least, height * height / m.squaredNorm());
}

// The interior minimum of two segments; those at their ends are found from the vertices.
Scalar segments_sq(const Vector3& p, const Vector3& q, const Vector3& r, const Vector3& s) {
  const Vector3 d = q - p, e = s - r, w = p - r;
  const Scalar dd = d.squaredNorm(), ee = e.squaredNorm(), de = d.dot(e);
  const Scalar determinant = dd * ee - de * de;
  if (!(determinant > 0)) return kInfinity;
  const Scalar t = (de * e.dot(w) - ee * d.dot(w)) / determinant;
  const Scalar u = (dd * e.dot(w) - de * d.dot(w)) / determinant;
  if (t < 0 || t > 1 || u < 0 || u > 1) return kInfinity;
  return (w + t * d - u * e).squaredNorm();
}

// Whether the segment from p to q goes through the triangle.
bool pierces(const Vector3& p, const Vector3& q, const Triangle& t) {
  const Vector3 m = (t[1] - t[0]).cross(t[2] - t[0]);
  const Scalar hp = m.dot(p - t[0]), hq = m.dot(q - t[0]);
  if (!(hp * hq <= 0) || hp == hq) return false;
  const Vector3 x = p + hp / (hp - hq) * (q - p);
  for (std::size_t i = 0; i < 3; ++i) {
    if (m.cross(t[(i + 1) % 3] - t[i]).dot(x - t[i]) < 0) return false;
  }
  return true;
}

}  // namespace

Scalar plain_distance(const Triangle& a, const Triangle& b) {
  Scalar least = kInfinity;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector3& a1 = a[(i + 1) % 3];
    const Vector3& b1 = b[(i + 1) % 3];
    if (pierces(a[i], a1, b) || pierces(b[i], b1, a)) return 0;
    least = std::min({least, point_triangle_sq(a[i], b), point_triangle_sq(b[i], a)});
    for (std::size_t k = 0; k < 3; ++k) {
      least = std::min(least, segments_sq(a[i], a1, b[k], b[(k + 1) % 3]));
    }
  }
  return std::sqrt(least);
}

}  // namespace dyop::testing
