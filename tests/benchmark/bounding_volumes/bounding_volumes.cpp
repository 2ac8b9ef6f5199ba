// SPDX-License-Identifier: BSD-3-Clause
#include "benchmark/bounding_volumes/bounding_volumes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace dyop::testing {
namespace {

// Squared sine below which edges count as parallel.
constexpr Scalar kParallelSq = 1e-8;  // literal: gaps along their cross product keep 12 digits

struct Extent {
  explicit Extent(std::span<const Vector3> points, const Matrix3& axes = Matrix3::Identity()) {
    for (const Vector3& p : points) {
      const Vector3 x = axes.transpose() * p;
      lo = lo.cwiseMin(x);
      hi = hi.cwiseMax(x);
    }
  }
  Vector3 middle() const { return (lo + hi) / 2; }
  Scalar half_area() const {
    const Vector3 d = hi - lo;
    return d.x() * d.y() + d.y() * d.z() + d.z() * d.x();
  }

  Vector3 lo = Vector3::Constant(kInfinity);
  Vector3 hi = Vector3::Constant(-kInfinity);
};

// Orthonormal columns: towards the longest edge, then within the triangle, then its normal. The
// identity for triangles without area.
Matrix3 triangle_axes(std::span<const Vector3> points) {
  Vector3 longest = Vector3::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector3 edge = points[(i + 1) % 3] - points[i];
    if (edge.squaredNorm() > longest.squaredNorm()) longest = edge;
  }
  const Vector3 normal = (points[1] - points[0]).cross(points[2] - points[0]);
  if (!(normal.norm() > 0)) return Matrix3::Identity();
  Matrix3 axes;
  axes.col(0) = longest.normalized();
  axes.col(2) = normal.normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

// Orthonormal columns from the greatest to the least variance.
Matrix3 principal_axes(std::span<const Vector3> points) {
  if (points.size() == 3) return triangle_axes(points);
  Vector3 mean = Vector3::Zero();
  for (const Vector3& p : points) mean += p / Scalar(points.size());
  Matrix3 covariance = Matrix3::Zero();
  for (const Vector3& p : points) covariance += (p - mean) * (p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(covariance);
  return solver.eigenvectors().rowwise().reverse();
}

// Turns along `center`, the vector between the centers, and into the frame of A. Gaps below zero
// separate nothing.
Separation make_separation(Scalar gap, const Vector3& nhat, const Vector3& center,
                           const Matrix3& axes) {
  if (!(gap > 0)) return {};
  return {gap, axes * (nhat.dot(center) < 0 ? Vector3(-nhat) : nhat)};
}

// Boxes about the origin with half extents a, and about t with axes R and half extents b; S = |R|.
// Not separating_direction() nor find_axis() of the library: volumes are compared by the exact gap
// along the best axis, all in double precision and from the placement a hierarchy of each would
// have at hand, so that none pays for what another one needs.
Separation box_separation(const Matrix3& R, const Matrix3& S, const Vector3& t, const Vector3& a,
                          const Vector3& b, const Matrix3& axes) {
  const Vector3 u = R.transpose() * t;
  const Vector3 faces_a = t.cwiseAbs() - a - S * b;
  const Vector3 faces_b = u.cwiseAbs() - b - S.transpose() * a;
  int face_a = 0;
  int face_b = 0;
  const Scalar gap_a = faces_a.maxCoeff(&face_a);
  const Scalar gap_b = faces_b.maxCoeff(&face_b);
  Scalar gap = std::max({Scalar{0}, gap_a, gap_b});
  Vector3 nhat = gap_a > gap_b ? Vector3(Vector3::Unit(face_a)) : Vector3(R.col(face_b));
  for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3;
    const int i2 = (i + 2) % 3;
    for (int j = 0; j < 3; ++j) {
      const int j1 = (j + 1) % 3;
      const int j2 = (j + 2) % 3;
      const Scalar length_sq = R(i1, j) * R(i1, j) + R(i2, j) * R(i2, j);
      const Scalar edge_gap = std::abs(t[i2] * R(i1, j) - t[i1] * R(i2, j)) -
                              (a[i1] * S(i2, j) + a[i2] * S(i1, j)) -
                              (b[j1] * S(i, j2) + b[j2] * S(i, j1));
      if (edge_gap > 0 && edge_gap * edge_gap > gap * gap * length_sq && length_sq > kParallelSq) {
        gap = edge_gap / std::sqrt(length_sq);
        nhat = Vector3::Unit(i).cross(R.col(j)).normalized();
      }
    }
  }
  const Scalar length = t.norm();
  const Scalar center_gap = length - (a.dot(t.cwiseAbs()) + b.dot(u.cwiseAbs())) / length;
  if (center_gap > gap) {
    gap = center_gap;
    nhat = t / length;
  }
  return make_separation(gap, nhat, t, axes);
}

PrincipalBox make_box(const Extent& extent, const Matrix3& axes) {
  return {axes, axes * extent.middle(), (extent.hi - extent.lo) / 2};
}

// Rectangles with half sides a about the origin along x and y, and b about t along the first two
// columns of R.
class RectanglePair {
 public:
  RectanglePair(const Vector2& a, const Matrix3& R, const Vector3& t, const Vector2& b)
      : a_(a), R_(R), t_(t), b_(b), t_B_(R.transpose() * t) {}

  // The distance of the two: its direction is normal to a face, or it is that of two edges. Ends as
  // soon as a direction proves its own length.
  void solve() {
    if (try_face(Vector3::UnitZ(), a_, t_, R_, b_)) return;
    if (try_face(R_.col(2), b_, -t_B_, R_.transpose(), a_)) return;
    const bool are_parallel = 1 - R_(2, 2) * R_(2, 2) < kParallelSq;
    if (gap_ <= 0 && !are_parallel && !has_edge_axis()) return;
    // Edges on the side of the other rectangle come first.
    for (const Scalar side_b : {-1.0, 1.0}) {
      for (const Scalar side_a : {1.0, -1.0}) {
        for (const int i : {0, 1}) {
          for (const int j : {0, 1}) {
            if (try_edges(i, side_a, j, side_b)) return;
          }
        }
      }
    }
  }

  Scalar gap() const { return gap_; }
  const Vector3& nhat() const { return nhat_; }

 private:
  // In the frame of the one rectangle, with half sides `face`; `normal` is in that of A. True if
  // the other's nearest vertex along it lies over the one.
  bool try_face(const Vector3& normal, const Vector2& face, const Vector3& t, const Matrix3& R,
                const Vector2& other) {
    const Scalar gap =
        std::abs(t.z()) - other[0] * std::abs(R(2, 0)) - other[1] * std::abs(R(2, 1));
    if (gap > gap_) {
      gap_ = gap;
      nhat_ = normal;
    }
    if (gap <= 0) return false;
    Vector3 vertex = t;
    for (const int k : {0, 1}) {
      vertex -= std::copysign(other[k], t.z() * R(2, k)) * R.col(k);
    }
    return std::abs(vertex.x()) <= face[0] && std::abs(vertex.y()) <= face[1];
  }

  // The gap along v, times the length of v.
  Scalar gap_along(const Vector3& v) const {
    return std::abs(v.dot(t_)) - a_[0] * std::abs(v.x()) - a_[1] * std::abs(v.y()) -
           b_[0] * std::abs(v.dot(R_.col(0))) - b_[1] * std::abs(v.dot(R_.col(1)));
  }

  // If no normal and no cross product of edges separates two rectangles in planes that are not
  // parallel, then they meet.
  bool has_edge_axis() const {
    for (const int i : {0, 1}) {
      for (const int j : {0, 1}) {
        if (gap_along(Vector3::Unit(i).cross(R_.col(j))) > 0) return true;
      }
    }
    return false;
  }

  // The nearest points of the edge of A along axis i on a side of its center, and of B's along j;
  // side 1 is towards the center of B.
  bool try_edges(int i, Scalar side_a, int j, Scalar side_b) {
    Vector3 p = Vector3::Zero();
    p[1 - i] = std::copysign(a_[1 - i], side_a * t_[1 - i]);
    const Vector3 q = t_ + std::copysign(b_[1 - j], side_b * t_B_[1 - j]) * R_.col(1 - j);
    const Vector3 d = q - p;
    const Scalar cosine = R_(i, j);
    const Scalar along_a = d[i];
    const Scalar along_b = -d.dot(R_.col(j));
    const Scalar sine_sq = 1 - cosine * cosine;
    Scalar x = sine_sq > kParallelSq ? (along_a + cosine * along_b) / sine_sq : Scalar{0};
    x = std::clamp(x, -a_[i], a_[i]);
    const Scalar y = std::clamp(along_b + cosine * x, -b_[j], b_[j]);
    x = std::clamp(along_a + cosine * y, -a_[i], a_[i]);
    Vector3 v = d + y * R_.col(j);
    v[i] -= x;
    const Scalar length_sq = v.squaredNorm();
    const Scalar gap = gap_along(v);
    if (gap > 0 && gap * gap > gap_ * gap_ * length_sq) {
      const Scalar length = std::sqrt(length_sq);
      gap_ = gap / length;
      nhat_ = v / length;
    }
    return gap >= length_sq * (1 - 1e-12);  // literal: above the rounding of both
  }

  const Vector2& a_;
  const Matrix3& R_;
  const Vector3& t_;
  const Vector2& b_;
  Vector3 t_B_;
  Scalar gap_ = 0;
  Vector3 nhat_ = Vector3::UnitX();
};

}  // namespace

Sphere Sphere::fit(std::span<const Vector3> points) {
  constexpr int kSteps = 100;
  Vector3 center = Extent(points).middle();
  Sphere best{center, kInfinity};
  for (int step = 1; step <= kSteps; ++step) {
    const Vector3* farthest = &points.front();
    Scalar radius_sq = 0;
    for (const Vector3& p : points) {
      const Scalar distance_sq = (p - center).squaredNorm();
      if (distance_sq > radius_sq) {
        radius_sq = distance_sq;
        farthest = &p;
      }
    }
    if (radius_sq < best.radius * best.radius) best = {center, std::sqrt(radius_sq)};
    center += (*farthest - center) / Scalar(step + 1);
  }
  return best;
}

Separation separation(const RigidPose& X_AB, const Sphere& a, const Sphere& b) {
  const Vector3 t = X_AB * b.center - a.center;
  const Scalar length = t.norm();
  const Scalar gap = length - a.radius - b.radius;
  return gap > 0 ? Separation{gap, t / length} : Separation{};
}

AxisAlignedBox AxisAlignedBox::fit(std::span<const Vector3> points) {
  const Extent extent(points);
  return {extent.middle(), (extent.hi - extent.lo) / 2};
}

Separation separation(const AxisAlignedBox::Placement& placement, const AxisAlignedBox& a,
                      const AxisAlignedBox& b) {
  return box_separation(placement.X_AB.rotation(), placement.abs_R,
                        placement.X_AB * b.center - a.center, a.half_extents, b.half_extents,
                        Matrix3::Identity());
}

PrincipalBox PrincipalBox::fit(std::span<const Vector3> points) {
  const Matrix3 axes = principal_axes(points);
  return make_box(Extent(points, axes), axes);
}

Separation separation(const RigidPose& X_AB, const PrincipalBox& a, const PrincipalBox& b) {
  const Matrix3 R = a.axes.transpose() * (X_AB.rotation() * b.axes);
  const Vector3 t = a.axes.transpose() * (X_AB * b.center - a.center);
  return box_separation(R, R.cwiseAbs(), t, a.half_extents, b.half_extents, a.axes);
}

SmallerBox SmallerBox::fit(std::span<const Vector3> points) {
  const Matrix3 axes = principal_axes(points);
  const Extent principal(points, axes);
  const Extent aligned(points);
  if (points.size() == 3 || principal.half_area() < aligned.half_area()) {
    return {make_box(principal, axes)};
  }
  return {make_box(aligned, Matrix3::Identity())};
}

RectangleSweptSphere RectangleSweptSphere::fit(std::span<const Vector3> points) {
  const Matrix3 axes = principal_axes(points);
  const Extent extent(points, axes);
  const Scalar middle = extent.middle().z();
  const Scalar radius = (extent.hi.z() - extent.lo.z()) / 2;
  // How far a point may lie beyond a side, squared.
  const auto overhang_sq = [&](const Vector3& x) {
    const Scalar height = x.z() - middle;
    return std::max(Scalar{0}, radius * radius - height * height);
  };
  // Each pair of sides separately: every point must be less than its overhang beyond.
  Vector2 lo = Vector2::Constant(kInfinity);
  Vector2 hi = Vector2::Constant(-kInfinity);
  for (const Vector3& p : points) {
    const Vector3 x = axes.transpose() * p;
    const Scalar overhang = std::sqrt(overhang_sq(x));
    lo = lo.cwiseMin((x.head<2>().array() + overhang).matrix());
    hi = hi.cwiseMax((x.head<2>().array() - overhang).matrix());
  }
  for (const int i : {0, 1}) {
    if (lo[i] > hi[i]) lo[i] = hi[i] = (lo[i] + hi[i]) / 2;
  }
  // Then corners are moved out along the diagonal by s, with |(dx - s, dy - s)| the overhang.
  for (const Vector3& p : points) {
    const Vector3 x = axes.transpose() * p;
    const Vector2 above = x.head<2>() - hi;
    const Vector2 below = lo - x.head<2>();
    const Vector2 d = above.cwiseMax(below);
    const Scalar difference = d.x() - d.y();
    if (d.minCoeff() <= 0 || d.squaredNorm() <= overhang_sq(x)) continue;
    const Scalar s =
        (d.x() + d.y()) / 2 -
        std::sqrt(std::max(Scalar{0}, overhang_sq(x) / 2 - difference * difference / 4));
    for (const int i : {0, 1}) {
      if (above[i] > below[i]) {
        hi[i] += s;
      } else {
        lo[i] -= s;
      }
    }
  }
  const Vector2 center = (lo + hi) / 2;
  return {axes, axes * Vector3(center.x(), center.y(), middle), (hi - lo) / 2, radius};
}

Separation separation(const RigidPose& X_AB, const RectangleSweptSphere& a,
                      const RectangleSweptSphere& b) {
  const Matrix3 R = a.axes.transpose() * (X_AB.rotation() * b.axes);
  const Vector3 t = a.axes.transpose() * (X_AB * b.center - a.center);
  RectanglePair pair(a.half_sides, R, t, b.half_sides);
  pair.solve();
  return make_separation(pair.gap() - a.radius - b.radius, pair.nhat(), t, a.axes);
}

}  // namespace dyop::testing
