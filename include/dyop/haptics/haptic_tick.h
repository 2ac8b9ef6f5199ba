// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/haptics/virtual_coupling.h"

namespace DYOP_EXPORT dyop {

/// Largest number of hinges of a tool.
inline constexpr std::size_t kMostHinges = 4;

/// Input from a device: raw numbers, checked by HapticSession::update().
struct DevicePose {
  Vector3 p_WD = Vector3::Zero();
  Quaternion q_WD = Quaternion::Identity();
  std::array<Scalar, kMostHinges> angles{};  ///< requested of the hinges, radians
  std::uint32_t buttons = 0;                 ///< one bit each; for the caller, not read here

  DevicePose() = default;
  explicit DevicePose(const RigidPose& X_WD) : p_WD(X_WD.translation()), q_WD(X_WD.quaternion()) {}
};

/// Where the tool really is: the proxy.
struct ToolPose {
  RigidPose X_WT;
  std::array<Scalar, kMostHinges> angles{};
};

/// The tool at a time of a tick. In between, its origin moves on a line, and the tool and its
/// hinges turn at constant rates.
struct ToolWaypoint {
  Scalar time = 0;  ///< since the start of the tick; as before if tissue stood meanwhile
  ToolPose tool;
};

/// How a tick ended. In every status the proxy's motion of this tick is proven: no part of the tool
/// came nearer to a tissue, hard region or other tool than its target distance, or, if it already
/// was nearer, than it was (Recovering). The only exception is Overlapping, which names the pair.
enum class HapticStatus {
  NotRun,
  Free,          ///< the proxy is where the device is
  Held,          ///< contacts or regions hold it back: as near to the device as they allow
  Blocked,       ///< stopped short by the per-tick distance or round limit
  Deadline,      ///< the same for the deadline, or for HapticOptions::max_work
  Trapped,       ///< tissue closes in from all sides: it was stopped too, see tissue_stopped
  Recovering,    ///< something was nearer than its target at the start and is being left
  Overlapping,   ///< something crosses the tool: that pair is not proven, and is being left
  InvalidInput,  ///< unusable device pose or dt: the proxy stays, no wrench
  Outlier,       ///< no hand moves that fast: the tool goes on to the last pose, with its wrench
};

/// A status in plain words.
const char* words_of(HapticStatus status);

/// A point of a deforming obstacle's mesh.
struct SurfacePoint {
  std::int32_t triangle = 0;
  /// Barycentric coordinates: the shares of the triangle's corners in the point, which sum to one.
  std::array<Scalar, 3> weights{1, 0, 0};
};

enum class ContactState {
  Open,   ///< a candidate: near, but without force
  Stick,  ///< the force is inside the friction cone
  Slip,   ///< the force is on the friction cone, or there is no friction
};

/// A place where the proxy is held back, or may soon be.
struct ToolContactPoint {
  std::size_t tool = 0;           ///< of the session
  std::size_t obstacle = 0;       ///< of the scene; of HapticTick::tool_contacts the other tool
  std::size_t part = 0;           ///< body of the tool: 0 for all fixed parts, then one per hinge
  Vector3 p_W = Vector3::Zero();  ///< on the tool
  Vector3 nhat_W = Vector3::UnitX();  ///< unit, from the obstacle to the tool
  Scalar gap = 0;                     ///< at the start of the last motion
  Vector3 force_W = Vector3::Zero();  ///< on the tool
  ContactState state = ContactState::Open;
  std::optional<std::size_t> hinge = {};     ///< that turns the part
  Vector3 p_WO = Vector3::Zero();            ///< on the obstacle
  Vector3 v_WO = Vector3::Zero();            ///< velocity of the obstacle's material point there
  std::optional<SurfacePoint> surface = {};  ///< the same point; none: the obstacle is rigid
};

/// What an obstacle did to the tool at one place in one motion of a tick.
struct ToolImpulse {
  std::size_t obstacle = 0;
  Vector3 p_WO = Vector3::Zero();            ///< on the obstacle
  std::optional<SurfacePoint> surface = {};  ///< the same point; none: the obstacle is rigid
  /// On the tool, force times time; the obstacle takes the opposite.
  Vector3 impulse_W = Vector3::Zero();
};

/// Where an obstacle is between its snapshots.
struct ObstacleProgress {
  std::int64_t snapshot = 0;  ///< number of the snapshot or mesh it moves to or has reached
  Scalar fraction = 1;        ///< of the way there from where it set out, 0 to 1
};

/// What a tick found of a deforming obstacle when it began: all that other threads can tell it. For
/// recordings.
struct ObstacleInput {
  std::int64_t snapshot = 0;  ///< that the obstacle moved to or had reached
  Scalar end = 1;             ///< fraction of that motion at which it ends: see retarget()
  std::int64_t given = 0;     ///< what waits to follow, counted over all given; 0: nothing

  friend bool operator==(const ObstacleInput&, const ObstacleInput&) = default;
};

/// Certified distance of the tool from one obstacle at the end of the tick: lower <= d <= upper.
struct ToolClearance {
  Scalar lower = 0;
  Scalar upper = kInfinity;
  Vector3 p_WT = Vector3::Zero();  ///< nearest point of the tool when it was last measured
  Vector3 p_WO = Vector3::Zero();  ///< and of the obstacle
  bool is_breached = false;        ///< upper is below the margin
  /// A time before which the margin is not breached if the tool continues with the velocity of this
  /// tick and the obstacle at most at its own speed: a proven lower bound; infinite at rest.
  Scalar time_to_breach = kInfinity;
};

/// Where a deadline or HapticOptions::max_work cut off a tick, so that a replay can end at the same
/// place.
struct TickCutoff {
  std::int64_t checkpoint = 0;  ///< number of the checkpoint within the tick
  std::int64_t node_pairs = 0;  ///< of the query it fell in; 0: before it

  friend bool operator==(const TickCutoff&, const TickCutoff&) = default;
};

struct TickStatistics {
  std::int64_t impact_queries = 0;
  std::int64_t distance_queries = 0;
  std::int64_t node_pairs = 0;
  std::int64_t checkpoints = 0;  ///< places where a deadline can end the tick
  std::int64_t solves = 0;
  std::int64_t pieces = 0;  ///< motions committed
  std::int64_t work = 0;    ///< as HapticOptions::max_work counts it; not in recordings
};

/// Result of HapticSession::update() for a tool.
struct HapticTick {
  HapticStatus status = HapticStatus::NotRun;
  ToolPose tool;
  std::vector<ToolWaypoint> path;  ///< the committed motions: the start, then the end of each
  /// Where the n obstacles were at each waypoint: obstacle k at path[i] is number i * n + k. In
  /// between their fractions grow at constant rates.
  std::vector<ObstacleProgress> path_progress;
  ToolWrench wrench;                         ///< on the hand
  std::vector<ToolContactPoint> contacts;    ///< that held the proxy in its last motion
  std::vector<ToolContactPoint> candidates;  ///< that were near it then and had no force
  /// Impulses of all contacts with obstacles over the whole tick. Where the tool follows the device
  /// without running behind and touches no other tool, they sum to what the springs pulled with,
  /// times dt; dampers do not count.
  std::vector<ToolImpulse> impulses;
  Vector3 trocar_force_W = Vector3::Zero();  ///< of the tool's trocar on the tool
  std::vector<ToolClearance> clearances;     ///< one for each obstacle
  /// Where several tools are in the scene: the contacts with the others, also those without a force
  /// (ContactState::Open), and one clearance for each tool, of which its own is infinite.
  std::vector<ToolContactPoint> tool_contacts;
  std::vector<ToolClearance> tool_clearances;
  Scalar energy_returned = 0;  ///< see VirtualCoupling
  Scalar tissue_stopped = 0;   ///< time of this tick during which tissue was stopped
  /// Delay behind the newest snapshot caused by stops since it arrived; maximum over obstacles, 0
  /// once reached.
  Scalar tissue_lag = 0;
  /// How far tissue from which snapshots are expected (HapticSession::expect_snapshots()) is behind
  /// the session's time: how long it has waited for them since the first, as for a model slower
  /// than the clock, or was stopped. Maximum over obstacles.
  Scalar tissue_behind = 0;
  /// Per obstacle: total of snapshots and meshes given before the tick.
  std::vector<std::int64_t> snapshots;
  std::vector<ObstacleProgress> progress;  ///< per obstacle, at the end of the tick
  std::vector<ObstacleInput> inputs;       ///< per obstacle, at its start
  Scalar time = 0;                         ///< at the end of the tick: HapticSession::time()
  std::optional<TickCutoff> cutoff;        ///< if the tick was cut off
  std::chrono::nanoseconds latency{0};     ///< of this call
  TickStatistics statistics;
};

}  // namespace dyop
