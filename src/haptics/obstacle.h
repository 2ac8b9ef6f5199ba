// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "dyop/contact/contact_generator.h"
#include "dyop/contact/contact_point.h"
#include "dyop/distance/distance.h"
#include "dyop/haptics/haptic_scene.h"
#include "dyop/haptics/haptic_session.h"
#include "dyop/haptics/haptic_tick.h"
#include "dyop/toi/time_of_impact.h"
#include "haptics/tool_body.h"
#include "haptics/work_clock.h"
#include "toi/deforming/pair_front.h"

namespace dyop::haptics_internal {

/// A point where an obstacle A may hold a body B of a tool, at the start of a motion.
struct HoldPoint {
  std::size_t body = 0;
  std::size_t obstacle = 0;
  std::optional<std::size_t> other = {};  ///< A is this body, of another tool
  Vector3 p_WA = Vector3::Zero();
  Vector3 p_WB = Vector3::Zero();
  Vector3 nhat_AB_W = Vector3::UnitX();
  Vector3 v_WA = Vector3::Zero();            ///< velocity of A's material point
  std::optional<SurfacePoint> surface = {};  ///< p_WA on A's mesh, if A deforms
  ContactKey key;
  Vector3 impulse_W = Vector3::Zero();  ///< of the last solve, on B
  Scalar curvature = 0;                 ///< true gap at the end of the motion minus the linear one
  Scalar push = 0;                      ///< more than the rest gap, after repeated hits

  Scalar gap() const { return nhat_AB_W.dot(p_WB - p_WA); }
};

/// Data kept between queries for a piece of a body and an obstacle.
struct PieceMemory {
  DistanceCache cache;
  PairFront front;

  /// For other meshes.
  void restart() {
    cache.nearest.reset();
    front.restart();
    front.seed({0, -1, -1});
  }
};
/// For a body and an obstacle: one for each piece of the body.
using PairMemory = std::vector<PieceMemory>;

/// Memory that the queries of a session use one after the other.
struct QueryMemory {
  ToiWorkspace workspace;
  ContactWorkspace contact_workspace;
  std::vector<ContactPoint> contacts;
  std::vector<BoxPair> pairs;
};

/// Answer of Obstacle::first_impact().
struct PairImpact {
  ToiStatus status = ToiStatus::NotRun;
  Scalar t_safe = 0;
  bool has_hit = false;
  HoldPoint hit;  ///< points at the start of the motion
  std::int64_t queries = 0;
  std::int64_t node_pairs = 0;
};

/// The time that a query over [0, t] has proven; nothing if its budget ended before the first node
/// pair, so that a replay, which leaves such a query out, finds the same.
inline Scalar safe_time(const ToiResult& result) {
  const bool is_nothing =
      result.status == ToiStatus::BudgetExhausted && result.statistics.node_pairs == 0;
  return is_nothing ? 0 : result.t_safe;
}

/// Bounds of the distance of a body from an obstacle, with nearest points.
struct PairDistance {
  Scalar lower = 0;
  Scalar upper = kInfinity;
  Vector3 p_WA = Vector3::Zero();
  Vector3 p_WB = Vector3::Zero();
};

/// How close the bounds of a distance have to be: at most `allowed` apart, unless the lower one is
/// proven to be at least farthest - allowed. If that takes a search: `tight` in place of it.
struct DistanceWish {
  Scalar farthest = kInfinity;
  Scalar allowed = 0;
  Scalar tight = 0;
};

/// A motion of a body to be proven, over [0, duration].
struct BodyMotion {
  const ToolBody& body;
  const Motion& X_WB;
  Scalar duration;
  Scalar displacement;           ///< bound of that of all points, relative to the obstacle's
  const Motion* X_WA = nullptr;  ///< of an obstacle that is a body of another tool
};

/// An obstacle of the session in its current state. Queries change only their memory; what is kept
/// of a pair must be told of every motion.
class Obstacle {
 public:
  virtual ~Obstacle() = default;

  std::string name;
  ObstacleRole role = ObstacleRole::Tissue;
  Scalar margin = 0;
  Scalar friction = 0;
  Scalar soft_stiffness = 0;

  /// The tool must not enter it.
  bool is_hard() const { return role == ObstacleRole::Tissue || role == ObstacleRole::HardRegion; }

  /// A body of a tool is elsewhere.
  virtual void move_to(const RigidPose& /*X_WA*/) {}
  /// Computes what queries about a body would otherwise compute at the first of them.
  virtual void prepare(const ToolBody& /*body*/, QueryMemory& /*memory*/) const {}
  /// As time_of_impact(), with A the obstacle.
  virtual PairImpact first_impact(const BodyMotion& motion, const ToiOptions& options,
                                  WorkClock& clock, PairMemory& kept,
                                  QueryMemory& memory) const = 0;
  /// Appends the points where the gap has a local minimum and matters for the approach, perhaps
  /// more that are within its reach; not all of them if the share is used up.
  virtual void add_holds(const ToolBody& body, const RigidPose& X_WB,
                         const ExpectedApproach& approach, WorkShare& share, PairMemory& kept,
                         QueryMemory& memory, std::vector<HoldPoint>& holds) const = 0;
  /// Bounds as close as wished, besides rounding, unless the share is used up.
  virtual PairDistance measure(const ToolBody& body, const RigidPose& X_WB,
                               const DistanceWish& wish, WorkShare& share,
                               PairMemory& kept) const = 0;
  /// An upper bound at once, from the places where the pair was nearest when last measured; or
  /// none.
  virtual PairDistance measure_again(const ToolBody& /*body*/, const RigidPose& /*X_WB*/,
                                     const PairMemory& /*kept*/) const {
    return {};
  }
  /// Whether a body in a pose where it is not would be farther away than the margin, proven;
  /// nothing if the clock runs out.
  virtual std::optional<bool> is_apart_at(const ToolBody& body, const RigidPose& X_WB,
                                          WorkClock& clock, PairMemory& kept) const = 0;

  /// Bound of the speed of its points until time_left().
  virtual Scalar speed() const { return 0; }
  /// How long its current motion lasts.
  virtual Scalar time_left() const { return kInfinity; }
  /// Takes over the snapshots of other threads; later ones wait for the next tick.
  /// @return As go_on().
  virtual bool start_tick() { return false; }
  /// Other threads may take back what was not started on.
  virtual void end_tick() {}
  /// From now on start_tick() takes over no more than so many snapshots and meshes in all.
  virtual void let_see(std::int64_t /*snapshots*/) {}
  /// Snapshots and meshes given before the tick.
  virtual std::int64_t snapshots_seen() const { return 0; }
  virtual ObstacleProgress progress() const { return {}; }
  /// What start_tick() found.
  virtual ObstacleInput input() const { return {}; }
  /// Time passes in which it does not move, although it should.
  virtual void stop(Scalar /*dt*/) {}
  /// How much later it reaches the newest snapshot seen, since it was stopped.
  virtual Scalar lag() const { return 0; }
  /// How long it has waited for expected snapshots, or was stopped, since the first of them.
  virtual Scalar behind() const { return 0; }
  /// Until told otherwise it stands still, whatever time passes: all above and below is that of
  /// something at rest.
  virtual void stand(bool /*is_standing*/) {}
  /// Advances time by at most time_left().
  virtual void pass(Scalar /*dt*/) {}
  /// Starts its next motion when the current one has ended, or comes to rest if there is none.
  /// @return Whether it is now another mesh: nothing that is kept of it holds any longer.
  virtual bool go_on() { return false; }
};

std::unique_ptr<Obstacle> make_rigid_obstacle(const ToolObstacle& obstacle);

/// The tools and what is around them, as they are now. Where there are several tools, the bodies of
/// each are obstacles for those after it: the obstacles of the scene come first, then all bodies.
struct LoopScene {
  LoopScene(const HapticScene& scene, const HapticOptions& given);

  RigidPose body_pose(const ToolPoses& poses, std::size_t body) const {
    const std::size_t tool = bodies[body].tool;
    return poses[tool].X_WT * body_in_tool(bodies[body], tools[tool].hinges, poses[tool]);
  }
  /// The body that an obstacle is; none: it is one of the scene's.
  std::optional<std::size_t> body_of(std::size_t obstacle) const {
    if (obstacle < scene_obstacles) return std::nullopt;
    return obstacle - scene_obstacles;
  }
  /// What a tool must be kept apart from are the first ones of the obstacles: so many.
  std::size_t obstacles_of(std::size_t tool) const {
    return scene_obstacles + (tools.size() > 1 ? first_body[tool] : 0);
  }
  /// Tells obstacles that are bodies where they are.
  void place(const ToolPoses& poses) const;

  HapticOptions options;
  std::vector<HapticTool> tools;        // each with its springs
  std::vector<ToolBody> bodies;         // by tool
  std::vector<std::size_t> first_body;  // by tool, and the end of the last one's
  std::vector<std::unique_ptr<Obstacle>> obstacles;
  std::size_t scene_obstacles = 0;
};

}  // namespace dyop::haptics_internal
