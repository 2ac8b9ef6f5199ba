// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/distance/gjk.h"
#include "dyop/distance/triangle_distance.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/paper/planar_distance.h"

/// The closest-feature walk of [LinCanny1991], with the safeguards of [Mirtich1998] so that it
/// always ends.
///
/// A walk goes from a pair of features to a neighbouring pair that is nearer, for as long as a
/// nearest point lies outside the Voronoi region of the other's feature. Its result is checked like
/// any other candidate: the slab between the features must prove it. If it does not (the shapes
/// intersect, or rounding stopped the walk), another certified algorithm answers. So the bounds
/// hold whatever the walk does. Method and measurements: docs/algorithms/published_dyop.md.
namespace DYOP_EXPORT dyop {

/// Where a walk starts, and what the last one did. A query of the same pair at a nearby pose then
/// takes one or two steps. Affects speed only. Numbers that fit no feature of the shapes are
/// ignored.
struct LinCannyCache {
  /// Place on a shape: kind and number of the feature; Smooth for none.
  struct Place {
    FeatureKind kind = FeatureKind::Smooth;
    std::int32_t number = -1;
  };
  Place a;
  Place b;
  int steps = 0;              ///< of the last query
  bool is_certified = false;  ///< of the last query: the walk's own end was proven
};

/// Distance of two triangles. Guarantees and arguments as triangle_distance(), which is the
/// fallback, but upper - lower may be twice triangle_noise().
TriangleDistance lin_canny_distance(const Triangle& a, const Triangle& b,
                                    LinCannyCache* cache = nullptr);

/// Distance of two triangles in the plane. Guarantees and arguments as planar_triangle_distance().
PlanarDistance lin_canny_distance(const PlanarTriangle& a, const PlanarTriangle& b,
                                  LinCannyCache* cache = nullptr);

/// Distance of two convex polygons. Guarantees and arguments as convex_polygon_distance(), which is
/// the fallback. Cost: the walk, and a scan of all vertices for the proof.
PlanarDistance lin_canny_distance(std::span<const Vector2> a, std::span<const Vector2> b,
                                  LinCannyCache* cache = nullptr);

/// A convex hull with its edges and their neighbours, as the walk needs them. Built once per shape.
class HullFeatures {
 public:
  struct Edge {
    std::array<std::int32_t, 2> vertices;
    std::array<std::int32_t, 2> faces;  ///< triangle numbers of core_surface(); -1 for none
  };

  /// Cost: sorting the edges.
  explicit HullFeatures(ConvexHull hull);

  const ConvexHull& hull() const { return hull_; }
  std::span<const Edge> edges() const { return edges_; }
  /// Edge numbers of a face, edge k being the one from its vertex k.
  const std::array<std::int32_t, 3>& edges_of_face(std::int32_t face) const {
    return edges_of_face_[static_cast<std::size_t>(face)];
  }
  std::span<const std::int32_t> edges_of_vertex(std::int32_t vertex) const;

 private:
  ConvexHull hull_;
  std::vector<Edge> edges_;
  std::vector<std::array<std::int32_t, 3>> edges_of_face_;
  std::vector<std::int32_t> edges_of_vertices_;  // of vertex 0, then of vertex 1, ...
  std::vector<std::int32_t> first_edge_;  // by vertex: index into edges_of_vertices_; and the end
};

/// Distance of two convex hulls of any size and dimension. Guarantees and arguments as
/// gjk_distance(), which is the fallback. `iterations` counts the steps of the walk and of the
/// fallback.
GjkResult lin_canny_distance(const HullFeatures& a, const HullFeatures& b, const RigidPose& X_AB,
                             LinCannyCache* cache = nullptr);

}  // namespace dyop
