// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "dyop/distance/distance.h"
#include "dyop/distance/ray_cast.h"
#include "dyop/toi/least_distance.h"
#include "dyop/toi/time_of_impact.h"

namespace DYOP_EXPORT dyop {

namespace toi_internal {
struct ObstacleMemory;
struct ObstacleSetData;
}  // namespace toi_internal

/// Identifies an obstacle of an ObstacleSet. Fixed while the obstacle is in the set; never reused
/// for another one of that set.
enum class ObstacleId : std::uint64_t {};

/// A shape in the world, at rest or on a motion.
struct Obstacle {
  std::shared_ptr<const Shape> shape = {};
  std::shared_ptr<const Motion> X_WO = {};  ///< RestMotion for one at rest
  std::uint32_t groups = 1;                 ///< bit set; queries select by it
  bool is_solid = false;  ///< treat a closed mesh as a solid, as ToiOptions::solid_b
};

/// Which obstacles a query considers: those that share a group with it and that `accepts` accepts.
struct ObstacleFilter {
  std::uint32_t groups = ~std::uint32_t{0};
  /// Called at most once per obstacle and query, in no fixed order; empty: all.
  std::function<bool(ObstacleId)> accepts = {};
};

/// Result of ObstacleSet::first_impact(). What `toi` states about the distance of two shapes holds
/// for the distance of the body from every obstacle the filter accepts: Separated, t_safe,
/// rounding allowance and statistics cover all of them. A is the body, B is `obstacle`.
struct ObstacleImpact {
  ToiResult toi;
  /// The obstacle the status refers to: the first one hit, or the first that could not be decided.
  /// If several tie in time, the one with the least id. Empty if Separated.
  std::optional<ObstacleId> obstacle;
  /// The fraction of the interval proven free: 1 if Separated.
  Scalar free_fraction = 0;
};

/// Result of ObstacleSet::nearest(). `distance` holds bounds of the least distance over all
/// obstacles: infinite if there is none. A is the body, B is `obstacle`.
struct NearestObstacle {
  DistanceResult distance;
  std::optional<ObstacleId> obstacle;
};

/// Result of ObstacleSet::least_distance(), likewise.
struct ObstacleClearance {
  LeastDistanceResult distance;
  std::optional<ObstacleId> obstacle;
};

/// Result of ObstacleSet::ray_cast(): what RayHit promises holds for all obstacles.
struct ObstacleHit {
  RayHit hit;
  std::optional<ObstacleId> obstacle;  ///< the first one hit; of several, the one with the least id
};

/// Memory of ObstacleSet::first_impact(), kept by the caller between queries. Serves one query at a
/// time.
class ObstacleWorkspace {
 public:
  ObstacleWorkspace();
  ~ObstacleWorkspace();
  ObstacleWorkspace(ObstacleWorkspace&&) noexcept;
  ObstacleWorkspace& operator=(ObstacleWorkspace&&) noexcept;

  toi_internal::ObstacleMemory& memory() { return *memory_; }

 private:
  std::unique_ptr<toi_internal::ObstacleMemory> memory_;
};

/// Many placed shapes, for queries of one body against all of them in one call: faster than a loop,
/// because obstacles far from the body's path are never examined, and no pair is pursued beyond the
/// first impact.
///
/// Queries are const, may run in several threads at once while the set does not change, and are
/// deterministic unless a deadline or stop ends them: apart from ids, results do not depend on the
/// order in which obstacles were added, moved or removed. See docs/algorithms/obstacle_set.md.
class ObstacleSet {
 public:
  ObstacleSet();
  ~ObstacleSet();
  ObstacleSet(ObstacleSet&&) noexcept;
  ObstacleSet& operator=(ObstacleSet&&) noexcept;

  /// @throws InvalidArgument if shape or motion is missing, or a solid is an open mesh.
  ObstacleId add(Obstacle obstacle);
  /// An obstacle at rest.
  ObstacleId add(std::shared_ptr<const Shape> shape, const RigidPose& X_WO,
                 std::uint32_t groups = 1);
  /// Under the id that the obstacle had in another set, so that a copy has the same ids. Ids of
  /// obstacles that were removed from that set may be given again.
  /// @throws InvalidArgument likewise, or if the id's place is taken or beyond 2^24.
  void add_as(ObstacleId id, Obstacle obstacle);
  /// Moves an obstacle to another pose, or puts it on another motion.
  /// @throws InvalidArgument if the id is not in the set, as do remove() and obstacle().
  void move(ObstacleId id, const RigidPose& X_WO);
  void move(ObstacleId id, std::shared_ptr<const Motion> X_WO);
  void remove(ObstacleId id);

  bool contains(ObstacleId id) const;
  const Obstacle& obstacle(ObstacleId id) const;
  std::size_t size() const;
  /// Ids of all obstacles, in ascending order.
  std::vector<ObstacleId> ids() const;

  /// The first time at which the body comes within the target distance of an obstacle, or a proof
  /// that it does not. Budget, deadline and stop are those of the whole call. An undecided query
  /// cannot be resumed.
  /// @param options As for time_of_impact(); solid_b must be false: Obstacle::is_solid replaces it.
  /// @throws InvalidArgument as time_of_impact().
  ObstacleImpact first_impact(const Shape& body, const Motion& X_WB, const TimeInterval& interval,
                              const ToiOptions& options = {},
                              const ObstacleFilter& filter = {}) const;
  /// The same, in the memory of `workspace`.
  ObstacleImpact first_impact(const Shape& body, const Motion& X_WB, const TimeInterval& interval,
                              const ToiOptions& options, const ObstacleFilter& filter,
                              ObstacleWorkspace& workspace) const;

  /// The obstacle nearest to the body at one time.
  /// @param t Time at which moving obstacles are placed.
  /// @throws InvalidArgument as distance(); if solid_b is set; if t is not finite or an obstacle's
  ///         motion is undefined at t.
  NearestObstacle nearest(const Shape& body, const RigidPose& X_WB, Scalar t = 0,
                          const DistanceOptions& options = {},
                          const ObstacleFilter& filter = {}) const;

  /// The first obstacle that a ray, or a ball on a straight path, meets at one time.
  /// @param t Time at which moving obstacles are placed.
  /// @throws InvalidArgument as dyop::ray_cast(); if t is not finite or an obstacle's motion is
  ///         undefined at t.
  ObstacleHit ray_cast(const Ray& ray, Scalar t = 0, const ObstacleFilter& filter = {}) const;

  /// The least distance of the body from any obstacle over an interval. All share the budget.
  /// @throws InvalidArgument as dyop::least_distance(); if solid_b is set.
  ObstacleClearance least_distance(const Shape& body, const Motion& X_WB,
                                   const TimeInterval& interval,
                                   const LeastDistanceOptions& options = {},
                                   const ObstacleFilter& filter = {}) const;

 private:
  std::unique_ptr<toi_internal::ObstacleSetData> data_;
};

}  // namespace dyop
