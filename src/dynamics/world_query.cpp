// SPDX-License-Identifier: BSD-3-Clause
#include <utility>

#include "distance/pivot_seed.h"
#include "dynamics/world_impl.h"
#include "dyop/core/error.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/steady_motions.h"

// Queries of the bodies of a World as they stand.
namespace dyop {

using dynamics_internal::BodyRecord;

namespace dynamics_internal {
namespace {

bool is_closed_mesh(const Shape& shape) {
  return shape.kind() == ShapeKind::TriangleMesh &&
         static_cast<const TriangleMesh&>(shape).is_closed();
}

bool is_considered(const BodyRecord& body, const BodyFilter& filter) {
  const BodyDefinition& definition = body.definition;
  if (!body.is_present() || (definition.is_sensor && !filter.includes_sensors)) return false;
  if ((definition.filter.category & filter.mask) == 0) return false;
  if ((definition.filter.mask & filter.category) == 0) return false;
  return !filter.accepts || filter.accepts(body.id);
}

bool is_same(const RigidPose& x, const RigidPose& y) {
  return x.translation() == y.translation() && x.rotation() == y.rotation();
}

// The default tolerance of a point and a body is a part of the body's size, which a half-space has
// not: that of the smallest other body, or of the ray. None without half-spaces.
std::optional<Scalar> tolerance_beside_half_spaces(const std::deque<BodyRecord>& bodies,
                                                   Scalar length) {
  bool has_half_space = false;
  Scalar size = length;
  for (const BodyRecord& body : bodies) {
    if (!body.is_present()) continue;
    if (as_half_space(*body.definition.shape)) {
      has_half_space = true;
    } else if (body.size > 0) {
      size = std::min(size, body.size);
    }
  }
  return has_half_space ? std::optional(kDefaultRelativeTolerance * size) : std::nullopt;
}

}  // namespace

void BodyObstacles::update(const std::deque<BodyRecord>& bodies, std::uint64_t revision) {
  if (revision_ == revision) return;
  entries_.resize(bodies.size());
  for (std::uint32_t slot = 0; slot < bodies.size(); ++slot) {
    const BodyRecord& body = bodies[slot];
    Entry& entry = entries_[slot];
    if (entry.id && (!body.is_present() || entry.shape != body.definition.shape)) {
      set_.remove(*entry.id);
      slots_.erase(std::uint64_t(*entry.id));
      entry.id.reset();
    }
    if (!body.is_present()) continue;
    const RigidPose X_WB = body.X_WB();
    if (!entry.id) {
      Obstacle obstacle;
      obstacle.shape = body.definition.shape;
      obstacle.X_WO = std::make_shared<RestMotion>(X_WB);
      obstacle.is_solid = is_closed_mesh(*body.definition.shape);
      entry = {set_.add(std::move(obstacle)), body.definition.shape, X_WB};
      slots_[std::uint64_t(*entry.id)] = slot;
    } else if (!is_same(entry.X_WB, X_WB)) {
      set_.move(*entry.id, X_WB);
      entry.X_WB = X_WB;
    }
  }
  revision_ = revision;
}

ObstacleFilter BodyObstacles::filter(const std::deque<BodyRecord>& bodies,
                                     const BodyFilter& filter) const {
  ObstacleFilter result;
  result.accepts = [this, &bodies, &filter](ObstacleId id) {
    return is_considered(bodies[slots_.at(std::uint64_t(id))], filter);
  };
  return result;
}

std::optional<BodyId> BodyObstacles::body(const std::deque<BodyRecord>& bodies,
                                          const std::optional<ObstacleId>& id) const {
  if (!id) return std::nullopt;
  return bodies[slots_.at(std::uint64_t(*id))].id;
}

}  // namespace dynamics_internal

BodyRayHit World::cast_ray(const Vector3& origin_W, const Vector3& direction_W, Scalar length,
                           const BodyFilter& filter) const {
  DYOP_REQUIRE(origin_W.allFinite(), "World::cast_ray: the origin must be finite, not (",
               origin_W.transpose(), ")");
  DYOP_REQUIRE(direction_W.allFinite() && direction_W.stableNorm() > 0,
               "World::cast_ray: the direction must be finite and not zero, not (",
               direction_W.transpose(), ")");
  DYOP_REQUIRE(length > 0 && length < kInfinity,
               "World::cast_ray: the length must be finite and > 0, not ", length);
  static const ConvexHull kPoint(std::vector<Vector3>{Vector3::Zero()});
  const Vector3 along = direction_W.stableNormalized();
  const ConstantTwistMotion ray(RigidPose(origin_W), {along, Vector3::Zero()});
  ToiOptions options;
  options.max_node_pairs = impl_->options.max_node_pairs;
  options.distance_tolerance =
      dynamics_internal::tolerance_beside_half_spaces(impl_->bodies, length);
  const ShapeHit met = cast_shape(kPoint, ray, {0, length}, options, filter);
  BodyRayHit hit;
  hit.status = met.toi.status;
  hit.body = met.body;
  hit.distance = met.toi.t_safe;
  if (met.toi.status == ToiStatus::Impact) {
    hit.p_W = met.toi.contact->p_WCb;
    hit.nhat_W = -met.toi.contact->nhat_AB_W;
    hit.triangle = met.toi.contact->triangle_b;
  }
  return hit;
}

ShapeHit World::cast_shape(const Shape& shape, const Motion& motion, const TimeInterval& interval,
                           const ToiOptions& options, const BodyFilter& filter) const {
  dynamics_internal::BodyObstacles& obstacles = impl_->obstacles;
  obstacles.update(impl_->bodies, impl_->revision);
  const ObstacleFilter accepts = obstacles.filter(impl_->bodies, filter);
  ObstacleImpact impact = obstacles.set().first_impact(shape, motion, interval, options, accepts);
  const std::optional<BodyId> body = obstacles.body(impl_->bodies, impact.obstacle);
  return {std::move(impact.toi), body, impact.free_fraction};
}

NearestBody World::nearest(const Shape& shape, const RigidPose& X_WS,
                           const DistanceOptions& options, const BodyFilter& filter) const {
  dynamics_internal::BodyObstacles& obstacles = impl_->obstacles;
  obstacles.update(impl_->bodies, impl_->revision);
  const ObstacleFilter accepts = obstacles.filter(impl_->bodies, filter);
  const NearestObstacle found = obstacles.set().nearest(shape, X_WS, 0, options, accepts);
  return {found.distance, obstacles.body(impl_->bodies, found.obstacle)};
}

BodyOverlaps World::overlaps(const Shape& shape, const RigidPose& X_WS, Scalar max_distance,
                             const BodyFilter& filter) const {
  DYOP_REQUIRE(max_distance >= 0 && max_distance < kInfinity,
               "World::overlaps: the distance must be finite and >= 0, not ", max_distance);
  BodyOverlaps result;
  const AlignedBox box = distance_internal::posed_box(shape, X_WS);
  DistanceOptions options;
  options.max_distance = max_distance;
  for (const BodyRecord& body : impl_->bodies) {
    if (!body.is_present()) continue;
    const RigidPose X_WB = body.X_WB();
    const Vector3 middle = X_WB * Vector3(body.box_B.center());
    const Vector3 half = X_WB.rotation().cwiseAbs() * (body.box_B.sizes() / 2);
    // literal: generous for rounding, at no cost
    const Scalar noise = 1e-9 * (middle.cwiseAbs().maxCoeff() + body.radius_B);
    const Vector3 apart = (middle - box.center()).cwiseAbs() - half - box.sizes() / 2;
    if (apart.maxCoeff() > max_distance + noise) continue;
    if (!dynamics_internal::is_considered(body, filter)) continue;
    options.solid_b = dynamics_internal::is_closed_mesh(*body.definition.shape);
    const DistanceResult found = distance(shape, X_WS, *body.definition.shape, X_WB, options);
    if (found.status == DistanceStatus::FartherThanMaxDistance) continue;
    const bool touches = found.status == DistanceStatus::Overlapping;
    (touches || found.upper <= max_distance ? result.bodies : result.undecided).push_back(body.id);
  }
  return result;
}

}  // namespace dyop
