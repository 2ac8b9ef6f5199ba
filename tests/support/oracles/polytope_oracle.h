// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "dyop/core/error.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/convex_shape.h"

namespace dyop::testing {

/// The hull of a few points, inflated by a radius: a convex shape without any optimisation.
class PointHull final : public ConvexShape {
 public:
  explicit PointHull(std::vector<Vector3> points, Scalar radius = 0)
      : points_(std::move(points)), radius_(radius) {
    for (const Vector3& p : points_) bounding_radius_ = std::max(bounding_radius_, p.norm());
    bounding_radius_ += radius;
  }

  const std::vector<Vector3>& points() const { return points_; }

  SupportPoint core_support(const Vector3& direction) const override {
    std::size_t best = 0;
    Scalar best_dot = direction.dot(points_[0]);
    for (std::size_t i = 1; i < points_.size(); ++i) {
      const Scalar dot = direction.dot(points_[i]);
      if (dot > best_dot) {
        best_dot = dot;
        best = i;
      }
    }
    return {points_[best], static_cast<std::int32_t>(best)};
  }
  Scalar rounding_radius() const override { return radius_; }
  Vector3 core_center() const override {
    Vector3 sum = Vector3::Zero();
    for (const Vector3& p : points_) sum += p;
    return sum / static_cast<Scalar>(points_.size());
  }
  AlignedBox bounding_box() const override {
    return {Vector3::Constant(-bounding_radius_), Vector3::Constant(bounding_radius_)};
  }
  Scalar bounding_radius() const override { return bounding_radius_; }
  MassProperties compute_mass_properties(Scalar) const override {
    throw InvalidArgument("a test shape has no mass");
  }

 private:
  std::vector<Vector3> points_;
  Scalar radius_;
  Scalar bounding_radius_ = 0;
};

inline PointHull make_box(const Vector3& half_extents, Scalar radius = 0) {
  std::vector<Vector3> corners;
  for (int i = 0; i < 8; ++i) {
    corners.emplace_back((i & 1 ? 1 : -1) * half_extents.x(), (i & 2 ? 1 : -1) * half_extents.y(),
                         (i & 4 ? 1 : -1) * half_extents.z());
  }
  return PointHull(std::move(corners), radius);
}

inline PointHull make_sphere(Scalar radius) {
  return PointHull({Vector3::Zero()}, radius);
}

inline PointHull make_capsule(Scalar half_length, Scalar radius) {
  return PointHull({Vector3(0, 0, -half_length), Vector3(0, 0, half_length)}, radius);
}

/// Distance of two cores by exhaustion in long double; shares no code with the library.
///
/// The nearest features of two disjoint polytopes are a vertex and a vertex, edge or face, or two
/// edges. All pairs of points and triples of points stand in for edges and faces: those inside the
/// hulls belong to the hulls too and cannot give less. The hulls are disjoint exactly if a face
/// normal, a cross product of edges or (for flat hulls) a vector between points separates them.
/// Cost grows with the fourth power of the number of points. Error about 1e-18 of the coordinates.
class PolytopeOracle {
 public:
  using Real = long double;
  using Vector = Eigen::Matrix<Real, 3, 1>;

  PolytopeOracle(const PointHull& a, const PointHull& b, const RigidPose& X_AB) {
    for (const Vector3& p : a.points()) a_.push_back(p.cast<Real>());
    for (const Vector3& p : b.points()) {
      b_.push_back(X_AB.rotation().cast<Real>() * p.cast<Real>() + X_AB.translation().cast<Real>());
    }
  }

  /// Zero for hulls that touch or intersect.
  Real core_distance() const {
    const Real nearest = nearest_features();
    return is_separated() ? nearest : 0;
  }

 private:
  static Real slab_gap(const std::vector<Vector>& low, const std::vector<Vector>& high,
                       const Vector& n) {
    Real max_low = -std::numeric_limits<Real>::infinity();
    Real min_high = std::numeric_limits<Real>::infinity();
    for (const Vector& p : low) max_low = std::max(max_low, n.dot(p));
    for (const Vector& p : high) min_high = std::min(min_high, n.dot(p));
    return min_high - max_low;
  }

  bool separates(const Vector& n) const {
    return slab_gap(a_, b_, n) > 0 || slab_gap(b_, a_, n) > 0;
  }

  bool is_separated() const {
    const std::vector<Vector> edges_a = edges(a_);
    const std::vector<Vector> edges_b = edges(b_);
    for (const auto& p : {edges_a, edges_b}) {
      for (std::size_t i = 0; i < p.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
          const Vector n = p[i].cross(p[j]);
          // Face normals, and in the plane of a flat hull the normals of its edges.
          if (separates(n) || separates(n.cross(p[i]))) return true;
        }
      }
    }
    for (const Vector& e : edges_a) {
      for (const Vector& f : edges_b) {
        if (separates(e.cross(f)) || separates(e.cross(f).cross(e))) return true;
      }
    }
    for (const Vector& p : a_) {
      for (const Vector& q : b_) {
        if (separates(q - p)) return true;
        for (const Vector& e : edges_a) {
          if (separates(e.cross(q - p).cross(e))) return true;
        }
        for (const Vector& e : edges_b) {
          if (separates(e.cross(q - p).cross(e))) return true;
        }
      }
    }
    return false;
  }

  static std::vector<Vector> edges(const std::vector<Vector>& points) {
    std::vector<Vector> result;
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) result.push_back(points[i] - points[j]);
    }
    return result;
  }

  Real nearest_features() const {
    Real best = std::min(vertex_to_faces(a_, b_), vertex_to_faces(b_, a_));
    for (std::size_t i = 0; i < a_.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        for (std::size_t k = 0; k < b_.size(); ++k) {
          for (std::size_t l = 0; l < k; ++l) {
            best = std::min(best, edge_to_edge(a_[i], a_[j], b_[k], b_[l]));
          }
        }
      }
    }
    return best;
  }

  // Vertex to vertex, edge interior and face interior.
  static Real vertex_to_faces(const std::vector<Vector>& vertices,
                              const std::vector<Vector>& hull) {
    Real best = std::numeric_limits<Real>::infinity();
    for (const Vector& p : vertices) {
      for (std::size_t i = 0; i < hull.size(); ++i) {
        best = std::min(best, (p - hull[i]).norm());
        for (std::size_t j = 0; j < i; ++j) {
          const Vector e = hull[j] - hull[i];
          const Real t = (p - hull[i]).dot(e) / e.squaredNorm();
          if (t > 0 && t < 1) best = std::min(best, (p - hull[i]).cross(e).norm() / e.norm());
          for (std::size_t k = 0; k < j; ++k) {
            best = std::min(best, point_to_face(p, hull[i], hull[j], hull[k]));
          }
        }
      }
    }
    return best;
  }

  static Real point_to_face(const Vector& p, const Vector& u, const Vector& v, const Vector& w) {
    const Vector n = (v - u).cross(w - u);
    const bool is_inside = n.dot((v - u).cross(p - u)) > 0 && n.dot((w - v).cross(p - v)) > 0 &&
                           n.dot((u - w).cross(p - w)) > 0;
    return is_inside ? std::abs(n.dot(p - u)) / n.norm() : std::numeric_limits<Real>::infinity();
  }

  // Only where both nearest points are inside the edges; else a vertex is involved.
  static Real edge_to_edge(const Vector& p, const Vector& q, const Vector& r, const Vector& s) {
    const Vector e = q - p;
    const Vector f = s - r;
    const Vector n = e.cross(f);
    const Real norm_sq = n.squaredNorm();
    const Real t = (r - p).cross(f).dot(n) / norm_sq;
    const Real u = (r - p).cross(e).dot(n) / norm_sq;
    const bool is_inside = t > 0 && t < 1 && u > 0 && u < 1;
    return is_inside ? std::abs(n.dot(r - p)) / n.norm() : std::numeric_limits<Real>::infinity();
  }

  std::vector<Vector> a_;
  std::vector<Vector> b_;
};

}  // namespace dyop::testing
