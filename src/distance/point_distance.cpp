// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/point_distance.h"

#include <algorithm>
#include <cmath>

#include "core/batch_run.h"
#include "core/tolerance.h"
#include "distance/core_distance.h"
#include "distance/gjk/triangle_core.h"
#include "distance/piece_distance.h"
#include "distance/point_search.h"
#include "dyop/core/error.h"
#include "dyop/distance/gjk.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/triangle_mesh.h"
#include "geometry/compound_tree.h"

namespace dyop {
namespace {

using distance_internal::NearestToPoint;

// A point and a shape in the shape's frame, and the rounding in their distance.
struct PointQuery {
  const Vector3& p_S;
  const PointDistanceOptions& options;
  Scalar noise;
};

void require_point_options(const PointDistanceOptions& options) {
  DYOP_REQUIRE(options.max_distance >= 0, "point_distance: max_distance must be >= 0, not ",
               options.max_distance);
}

void require_signable(const Shape& shape, const PointDistanceOptions& options) {
  if (!options.is_signed) return;
  switch (shape.kind()) {
    case ShapeKind::TriangleMesh:
      DYOP_REQUIRE(static_cast<const TriangleMesh&>(shape).is_closed(),
                   "point_distance: is_signed is set, but the mesh is not closed");
      return;
    case ShapeKind::Convex:
      DYOP_REQUIRE(as_half_space(shape) || static_cast<const ConvexShape&>(shape).core_surface(),
                   "point_distance: is_signed is set, but the shape has no core_surface()");
      return;
    case ShapeKind::Compound:
      DYOP_REQUIRE(false,
                   "point_distance: is_signed is set, but a compound has no signed distance");
      return;
  }
}

PointDistance point_result_of(const NearestToPoint& found, const TriangleMesh& mesh, Scalar noise) {
  PointDistance result;
  result.lower = std::max(0.0, found.nearest.lower - noise);
  result.upper = found.nearest.upper + noise;
  if (found.triangle < 0) return result;
  result.p_WC = found.nearest.p_C;
  result.nhat_W = found.nearest.nhat_C;
  result.feature = distance_internal::mesh_feature(
      found.nearest.feature, mesh.triangles()[static_cast<std::size_t>(found.triangle)]);
  result.triangle = found.triangle;
  return result;
}

// Turns the distance into one from inside.
void turn_inside(PointDistance& result) {
  // If the point may be on either side of the surface, both bounds stay.
  const Scalar lower = -result.upper;
  result.upper = result.lower > 0 ? -result.lower : result.upper;
  result.lower = lower;
  result.nhat_W = -result.nhat_W;
}

PointDistance from_mesh(const TriangleMesh& mesh, const PointQuery& query) {
  const NearestToPoint found = distance_internal::find_nearest_to_point(
      mesh, query.p_S, query.options.max_distance + query.noise);
  PointDistance result = point_result_of(found, mesh, query.noise);
  if (!query.options.is_signed) return result;
  if (contains(mesh, query.p_S)) {
    turn_inside(result);
  } else if (!(result.lower > 0)) {
    result.lower = -result.upper;
  }
  return result;
}

// For a convex shape without a surface: unsigned.
PointDistance from_smooth_core(const ConvexShape& shape, const PointQuery& query) {
  const distance_internal::TriangleCore point({query.p_S, query.p_S, query.p_S});
  const GjkResult gjk = gjk_distance(shape, point, RigidPose());
  PointDistance result;
  result.lower = std::max(0.0, gjk.lower - query.noise);
  result.upper = gjk.upper + query.noise;
  result.p_WC = gjk.is_overlapping ? query.p_S : gjk.p_a;
  result.nhat_W = gjk.nhat_AB;
  result.feature = gjk.feature_a;
  return result;
}

PointDistance from_half_space(const HalfSpace& shape, const PointQuery& query) {
  const Scalar height = shape.height(query.p_S);
  PointDistance result;
  result.lower = height - query.noise;
  result.upper = height + query.noise;
  result.p_WC = query.p_S - height * shape.normal();
  result.nhat_W = shape.normal();
  if (query.options.is_signed || height > 0) return result;
  result.lower = 0;
  result.upper = std::max(Scalar(0), result.upper);
  result.p_WC = query.p_S;
  return result;
}

PointDistance from_convex(const ConvexShape& shape, const PointQuery& query) {
  if (const HalfSpace* half_space = as_half_space(shape)) {
    return from_half_space(*half_space, query);
  }
  const TriangleMesh* core = shape.core_surface();
  if (!core) return from_smooth_core(shape, query);
  const Scalar radius = shape.rounding_radius();
  const Scalar limit = query.options.max_distance + radius + query.noise;
  const NearestToPoint found =
      distance_internal::find_nearest_to_point(*core, query.p_S, limit * (1 + 4 * kUnitRoundoff));
  PointDistance result = point_result_of(found, *core, query.noise);
  result.triangle.reset();
  if (core->is_closed() && contains(*core, query.p_S)) {
    turn_inside(result);
  } else if (core->is_closed() && !(result.lower > 0)) {
    result.lower = -result.upper;
  }
  const auto rounding = [&](Scalar x) { return 2 * kUnitRoundoff * (radius + std::abs(x)); };
  result.lower -= radius + rounding(result.lower);
  result.upper -= radius - rounding(result.upper);
  result.p_WC += radius * result.nhat_W;
  if (query.options.is_signed || result.lower > 0) return result;
  result.lower = 0;
  if (result.upper <= 0) result.p_WC = query.p_S;
  result.upper = std::max(0.0, result.upper);
  return result;
}

// The nearest of all children.
PointDistance from_compound(const CompoundShape& compound, const PointQuery& query) {
  PointDistance nearest;
  nearest.lower = kInfinity;
  const Scalar limit = query.options.max_distance + query.noise;
  const auto visit = [&](std::int32_t child) {
    const geometry_internal::CompoundPart& part = compound.tree().part(child);
    PointDistance found =
        part.mesh ? from_mesh(*part.mesh, query) : from_convex(*part.convex, query);
    found.child = child;
    const Scalar lower = std::min(nearest.lower, found.lower);
    if (found.upper < nearest.upper) nearest = found;
    nearest.lower = lower;
    return nearest.upper + query.noise;
  };
  const Scalar left_out =
      distance_internal::visit_parts_near_point(compound.tree(), query.p_S, limit, visit);
  nearest.lower = std::min(nearest.lower, std::max(0.0, left_out - query.noise));
  return nearest;
}

PointDistance answer_point(const Shape& shape, const RigidPose& X_WS, const Vector3& p_W,
                           const PointDistanceOptions& options) {
  const Vector3 p_S = X_WS.inverse() * p_W;
  const HalfSpace* half_space = as_half_space(shape);
  const Scalar size = half_space ? std::abs(half_space->offset()) : shape.bounding_radius();
  const Scalar noise = kPoseNoise * (distance_internal::length_for_noise(X_WS.translation()) +
                                     distance_internal::length_for_noise(p_W) + size);
  const PointQuery query{p_S, options, noise};
  PointDistance result;
  switch (shape.kind()) {
    case ShapeKind::TriangleMesh:
      result = from_mesh(static_cast<const TriangleMesh&>(shape), query);
      break;
    case ShapeKind::Convex:
      result = from_convex(static_cast<const ConvexShape&>(shape), query);
      break;
    case ShapeKind::Compound:
      result = from_compound(static_cast<const CompoundShape&>(shape), query);
      break;
  }
  result.p_WC = X_WS * result.p_WC;
  result.nhat_W = X_WS.rotation() * result.nhat_W;
  return result;
}

}  // namespace

PointDistance point_distance(const Shape& shape, const RigidPose& X_WS, const Vector3& p_W,
                             const PointDistanceOptions& options) {
  require_point_options(options);
  require_signable(shape, options);
  DYOP_REQUIRE(p_W.allFinite(), "point_distance: the point must be finite, not (", p_W.transpose(),
               ")");
  return answer_point(shape, X_WS, p_W, options);
}

void point_distance_batch(const Shape& shape, const RigidPose& X_WS,
                          std::span<const Vector3> points_W, std::span<PointDistance> results,
                          const PointDistanceOptions& options, const BatchOptions& batch_options) {
  DYOP_REQUIRE(points_W.size() == results.size(), "point_distance_batch: ", points_W.size(),
               " points, but space for ", results.size(), " results");
  require_point_options(options);
  require_signable(shape, options);
  for (std::size_t i = 0; i < points_W.size(); ++i) {
    DYOP_REQUIRE(points_W[i].allFinite(), "point_distance_batch: point ", i,
                 " must be finite, not (", points_W[i].transpose(), ")");
  }
  std::fill(results.begin(), results.end(), PointDistance());
  core_internal::run_batch_in_portions(points_W.size(), batch_options, [&](std::size_t i) {
    results[i] = answer_point(shape, X_WS, points_W[i], options);
  });
}

}  // namespace dyop
