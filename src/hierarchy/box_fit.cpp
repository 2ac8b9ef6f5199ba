// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/tolerance.h"
#include "hierarchy/split_tree.h"

namespace dyop::hierarchy_internal {
namespace {

// Principal axes and estimates are computed from at most twice this many triangles, evenly spread:
// more do not give smaller boxes or better trees.
constexpr std::size_t kSampleCount = 256;

std::size_t sample_stride(std::size_t count) {
  return std::max(std::size_t{1}, count / kSampleCount);
}

// A box along given axes, relative to a reference point.
struct Extent {
  Vector3 lo = Vector3::Constant(kInfinity);
  Vector3 hi = Vector3::Constant(-kInfinity);

  void include(const Vector3& y) {
    lo = lo.cwiseMin(y);
    hi = hi.cwiseMax(y);
  }
  Scalar half_area() const {
    const Vector3 size = hi - lo;
    return size.x() * size.y() + size.y() * size.z() + size.z() * size.x();
  }
};

// The box of an extent relative to `origin`, rounded up; see kBoxNoise for the bound. The extent
// contains zero, because the origin is one of the vertices. 1-norms are at least the norms and
// cannot overflow; the smallest normal number covers products that underflow.
OrientedBox box_of(const Extent& extent, const Matrix3& axes, const Vector3& origin) {
  OrientedBox box;
  box.axes = axes;
  box.center = origin + axes * (0.5 * extent.lo + 0.5 * extent.hi);
  box.half_extents = 0.5 * extent.hi - 0.5 * extent.lo;
  const Scalar noise = kBoxNoise * (box.center.lpNorm<1>() + box.half_extents.lpNorm<1>()) +
                       std::numeric_limits<Scalar>::min();
  box.half_extents.array() += noise;
  return box;
}

Vector3 any_perpendicular(const Vector3& unit) {
  int smallest = 0;
  unit.cwiseAbs().minCoeff(&smallest);
  return unit.cross(Vector3::Unit(smallest));
}

// Orthonormal columns a, b, a x b with a along `first` and b towards `second`, both with entries of
// at most about one. The identity if `first` is zero or something is not finite.
//
// Columns deviate from orthonormality by at most 8u per entry, as kBoxNoise assumes. Lengths:
// normalising a vector of length about one errs by 1.5u (squares), 1u (root) and 1u (quotient), and
// twice that in the square. Right angles: the last pass for b leaves 3u (dot product), 1u
// (difference) and 1u (quotient); the cross product errs less.
Matrix3 orthonormal_axes(const Vector3& first, const Vector3& second) {
  // stableNormalized() loses digits in its scaling; the second normalisation restores them.
  const Vector3 a = first.stableNormalized().normalized();
  // Written with a negation so that NaN is caught here too.
  if (!(a.squaredNorm() > 0.5) || !second.allFinite()) return Matrix3::Identity();
  Vector3 b = second - a.dot(second) * a;
  if (b.norm() <= kBoxNoise) b = any_perpendicular(a);
  b.normalize();
  // A second pass: the first may have cancelled most digits of b.
  b -= a.dot(b) * a;
  b.normalize();
  Matrix3 axes;
  axes << a, b, a.cross(b).normalized();
  return axes;
}

// Longest edge first, then the normal.
Matrix3 axes_of_triangle(const Triangle& triangle) {
  std::array<Vector3, 3> edges{triangle[1] - triangle[0], triangle[2] - triangle[1],
                               triangle[0] - triangle[2]};
  Scalar scale = 0;
  for (const Vector3& edge : edges) scale = std::max(scale, edge.lpNorm<Eigen::Infinity>());
  if (!(scale > 0)) return Matrix3::Identity();
  for (Vector3& edge : edges) edge /= scale;
  int longest = 0;
  for (int k = 1; k < 3; ++k) {
    if (edges[std::size_t(k)].squaredNorm() > edges[std::size_t(longest)].squaredNorm()) {
      longest = k;
    }
  }
  const Vector3& edge = edges[std::size_t(longest)];
  return orthonormal_axes(edge, edge.cross(edges[std::size_t((longest + 1) % 3)]));
}

Matrix3 principal_axes(std::span<const Triangle> triangles) {
  const Vector3 origin = triangles.front()[0];
  Vector3 sum = Vector3::Zero();
  Vector3 squares = Vector3::Zero();   // sums of x x, y y, z z
  Vector3 products = Vector3::Zero();  // of y z, z x, x y
  const std::size_t stride = sample_stride(triangles.size());
  Scalar count = 0;
  for (std::size_t k = 0; k < triangles.size(); k += stride) {
    for (const Vector3& vertex : triangles[k]) {
      const Vector3 d = vertex - origin;
      sum += d;
      squares += d.cwiseProduct(d);
      products += Vector3(d.y() * d.z(), d.z() * d.x(), d.x() * d.y());
    }
    count += 3;
  }
  Matrix3 sum_of_squares;
  sum_of_squares << squares.x(), products.z(), products.y(),  //
      products.z(), squares.y(), products.x(),                //
      products.y(), products.x(), squares.z();
  const Matrix3 covariance = sum_of_squares / count - (sum / count) * (sum / count).transpose();
  if (!covariance.allFinite()) return Matrix3::Identity();
  // The closed form loses digits, but they only affect how tight the box is.
  Eigen::SelfAdjointEigenSolver<Matrix3> solver;
  solver.computeDirect(covariance);
  return orthonormal_axes(solver.eigenvectors().col(2), solver.eigenvectors().col(1));
}

// Two candidate boxes of every stride-th triangle, relative to the first one's first vertex.
struct Candidates {
  Matrix3 axes;
  Extent principal;
  Extent aligned;

  Candidates(std::span<const Triangle> triangles, std::size_t stride)
      : axes(principal_axes(triangles)) {
    const Matrix3 axes_transposed = axes.transpose();
    const Vector3 origin = triangles.front()[0];
    for (std::size_t k = 0; k < triangles.size(); k += stride) {
      for (const Vector3& vertex : triangles[k]) {
        const Vector3 d = vertex - origin;
        principal.include(axes_transposed * d);
        aligned.include(d);
      }
    }
  }
  // False if the area is NaN, from overflow.
  bool is_principal_smaller() const { return principal.half_area() < aligned.half_area(); }
};

}  // namespace

OrientedBox fit_triangle(const Triangle& triangle) {
  const Matrix3 axes = axes_of_triangle(triangle);
  Extent extent;
  for (const Vector3& vertex : triangle) extent.include(axes.transpose() * (vertex - triangle[0]));
  return box_of(extent, axes, triangle[0]);
}

OrientedBox fit_triangles(std::span<const Triangle> triangles) {
  const Candidates boxes(triangles, 1);
  const Vector3& origin = triangles.front()[0];
  return boxes.is_principal_smaller() ? box_of(boxes.principal, boxes.axes, origin)
                                      : box_of(boxes.aligned, Matrix3::Identity(), origin);
}

Vector3 fitted_size(std::span<const Triangle> triangles) {
  const Candidates boxes(triangles, sample_stride(triangles.size()));
  const Extent& extent = boxes.is_principal_smaller() ? boxes.principal : boxes.aligned;
  return extent.hi - extent.lo;
}

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
