// SPDX-License-Identifier: BSD-3-Clause
#include "hierarchy/box_fit.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/tolerance.h"

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

}  // namespace dyop::hierarchy_internal
