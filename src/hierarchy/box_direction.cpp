// SPDX-License-Identifier: BSD-3-Clause
#include "hierarchy/box_direction.h"

#include <cmath>

namespace dyop::hierarchy_internal {
namespace {

// Keeps the direction with the largest ratio of gap to length; in a's frame.
struct BestDirection {
  Scalar gap = -kInfinity;
  Vector3 n = Vector3::UnitX();

  void offer_unit(Scalar offered, const Vector3& unit) {
    if (!(offered > gap)) return;
    gap = offered;
    n = unit;
  }
  // `offered` is the gap times the length; a root is taken only for gaps that separate.
  void offer(Scalar offered, const Vector3& direction) {
    const Scalar length_sq = direction.squaredNorm();
    // literal: below this a cross product of unit axes is rounding, and adds nothing to the faces.
    if (!(offered > 0) || !(length_sq > 1e-6)) return;
    const Scalar length = std::sqrt(length_sq);
    offer_unit(offered / length, direction / length);
  }
};

Scalar sign_of(Scalar x) {
  return x < 0 ? -1 : 1;
}

// The nine directions across an edge of either box. r: b's axes in a's frame, t: b's center.
void offer_edges(const Matrix3& r, const Matrix3& abs_r, const Vector3& t, const Vector3& h,
                 const Vector3& g, BestDirection& best) {
  for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3;
    const int i2 = (i + 2) % 3;
    for (int j = 0; j < 3; ++j) {
      const int j1 = (j + 1) % 3;
      const int j2 = (j + 2) % 3;
      const Scalar along = t[i2] * r(i1, j) - t[i1] * r(i2, j);
      const Scalar gap = std::abs(along) - h[i1] * abs_r(i2, j) - h[i2] * abs_r(i1, j) -
                         g[j1] * abs_r(i, j2) - g[j2] * abs_r(i, j1);
      if (!(gap > 0)) continue;
      Vector3 n = Vector3::Zero();
      n[i1] = -sign_of(along) * r(i2, j);
      n[i2] = sign_of(along) * r(i1, j);
      best.offer(gap, n);
    }
  }
}

}  // namespace

Vector3 separating_direction(const OrientedBox& a, const OrientedBox& b) {
  const Vector3 t = a.axes.transpose() * (b.center - a.center);
  const Matrix3 r = a.axes.transpose() * b.axes;
  const Matrix3 abs_r = r.cwiseAbs();
  const Vector3 t_b = r.transpose() * t;
  const Vector3& h = a.half_extents;
  const Vector3& g = b.half_extents;
  const Vector3 gaps_a = t.cwiseAbs() - h - abs_r * g;
  const Vector3 gaps_b = t_b.cwiseAbs() - g - abs_r.transpose() * h;
  BestDirection best;
  Vector3 between_faces = Vector3::Zero();
  for (int i = 0; i < 3; ++i) {
    best.offer_unit(gaps_a[i], sign_of(t[i]) * Vector3::Unit(i));
    best.offer_unit(gaps_b[i], sign_of(t_b[i]) * r.col(i));
    if (gaps_a[i] > 0) between_faces[i] = sign_of(t[i]) * gaps_a[i];
  }
  for (const Vector3& line : {between_faces, t}) {
    const Scalar length = line.norm();
    if (!(length > 0)) continue;
    const Vector3 n = line / length;
    best.offer_unit(n.dot(t) - n.cwiseAbs().dot(h) - (r.transpose() * n).cwiseAbs().dot(g), n);
  }
  // Edges of aligned boxes only repeat the directions of the faces.
  if (a.axes != b.axes) offer_edges(r, abs_r, t, h, g, best);
  // The axes may have unit length in single precision only.
  return (a.axes * best.n).normalized();
}

}  // namespace dyop::hierarchy_internal
