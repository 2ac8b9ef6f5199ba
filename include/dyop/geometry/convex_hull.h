// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/triangle_mesh.h"

namespace DYOP_EXPORT dyop {

namespace geometry_internal {
class HullClimber;
class PointScan;
struct HullSurface;
}  // namespace geometry_internal

/// Convex hull of points, or all points within a radius of it. A flat set gives a polygon, a
/// collinear one a segment, coincident points a point.
///
/// Computed by quickhull [Barber1996] on exact orientation predicates [Shewchuk1997]: every point
/// left out lies exactly in the hull of vertices(), and flat or nearly flat input is handled
/// exactly. (Coordinates that are 2^-200 of the largest or less count as zero.)
class ConvexHull final : public ConvexShape {
 public:
  /// @param points At least one, in any order; duplicates and inner points are dropped.
  /// @param radius How far the shape reaches beyond the hull, >= 0 and at most kLargestCoordinate.
  /// @throws InvalidArgument if there is no point, a coordinate is not finite or beyond
  ///         kLargestCoordinate, or the radius is out of range; the message names row and value.
  explicit ConvexHull(std::vector<Vector3> points, Scalar radius = 0);

  /// The corners, in the order of the input; all vertex numbers refer to this list.
  std::span<const Vector3> vertices() const { return surface_.vertices(); }

  /// 3 if the points enclose a volume, 2 a polygon, 1 a segment, 0 a point.
  int dimension() const { return dimension_; }

  /// Cost: a scan of the vertices if there are few; otherwise a climb along edges, with a scan only
  /// if rounding leaves its end in doubt.
  SupportPoint core_support(const Vector3& direction) const override;
  Scalar core_reach(const Vector3& direction) const override;
  Scalar rounding_radius() const override { return radius_; }
  Vector3 core_center() const override { return center_; }
  const TriangleMesh* core_surface() const override { return &surface_; }
  AlignedBox bounding_box() const override;
  Scalar bounding_radius() const override;
  /// Of a rounded hull by the closed form of its parts: prisms over faces, parts of cylinders along
  /// edges and of balls at vertices.
  /// @throws InvalidArgument also for a flat hull without a radius, and a rounded polygon.
  MassProperties compute_mass_properties(Scalar density) const override;

 private:
  ConvexHull(const std::vector<Vector3>& points, geometry_internal::HullSurface&& hull,
             Scalar radius);

  int dimension_;
  Scalar radius_;
  TriangleMesh surface_;
  Vector3 center_;
  std::shared_ptr<const geometry_internal::PointScan> scan_;
  std::shared_ptr<const geometry_internal::HullClimber> climber_;  // null if a scan is cheap
};

}  // namespace dyop
