// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "dyop/haptics/haptic_observer.h"
#include "dyop/haptics/haptic_scene.h"
#include "dyop/haptics/haptic_tick.h"
#include "dyop/haptics/virtual_coupling.h"

namespace DYOP_EXPORT dyop {

/// A point of the tool, fixed to the tool frame or turned by a hinge.
struct ToolPoint {
  Vector3 p_W = Vector3::Zero();
  std::optional<std::size_t> hinge = {};
};

/// How a point moves with the coordinates of the tool: its velocity is J times the velocity of T's
/// origin, the angular velocity (both in world) and the rates of the hinges. 3 x (6 + hinges).
/// @throws InvalidArgument if there is no such hinge.
Eigen::MatrixXd tool_jacobian(std::span<const ToolHinge> hinges, const ToolPose& tool,
                              const ToolPoint& point);

/// From one pose to another in these coordinates: displacement of T's origin, rotation vector and
/// changes of the hinges' angles, 6 + hinges numbers.
/// @throws InvalidArgument if there are more than kMostHinges.
Eigen::VectorXd tool_displacement(std::size_t hinges, const ToolPose& from, const ToolPose& to);
/// The inverse: where such a displacement takes the tool.
/// @throws InvalidArgument unless it has 6 to 6 + kMostHinges numbers.
ToolPose displaced(const ToolPose& from, const Eigen::VectorXd& displacement);

/// The compliance of the springs between device and tool along these coordinates: the diagonal of
/// K^-1, 6 + hinges numbers.
Eigen::VectorXd coupling_compliance(const CouplingOptions& coupling,
                                    std::span<const ToolHinge> hinges);
/// The same at points of the tool: forces f on n points, three numbers each, displace them by C f
/// while the device stands. C = J K^-1 J^T, 3n x 3n.
/// @throws InvalidArgument if there is no such hinge.
Eigen::MatrixXd coupling_compliance(const CouplingOptions& coupling,
                                    std::span<const ToolHinge> hinges, const ToolPose& tool,
                                    std::span<const ToolPoint> points);

struct HapticOptions {
  CouplingOptions coupling = {};
  /// A resting contact keeps the obstacle's margin plus the rest offset; the motion is proven never
  /// to come within the margin plus a small fraction of the rest offset. Length, > 0. A smaller one
  /// leaves a thinner gap and costs more rounds on curved surfaces. A hundredth of the tool's
  /// thickness works well.
  Scalar rest_offset = 0;
  /// How fast the tool leaves what it starts in, length per time, > 0.
  Scalar recovery_speed = 0;
  int max_rounds = 4;     ///< motions per tick, >= 1
  int max_attempts = 4;   ///< times that contacts are added and solved again per motion, >= 1
  int max_contacts = 24;  ///< per motion, >= 1
  /// How far the bounds of a clearance may differ, relative to it, besides the rest offset; > 0.
  /// They may differ more while the tool moves fast: see clearance_work.
  Scalar clearance_tolerance = 0.02;
  /// Work units (about 0.4 us each, >= 10) per tick for refining clearances; the loosest bounds go
  /// first, the rest wait for later ticks. The bounds always hold, only farther apart, and neither
  /// contacts nor margins depend on them.
  int clearance_work = 100;
  /// The pieces of work after which a tick is cut off as by a deadline, >= 10, but at the same
  /// place in every run; later ticks do the rest. A tool that is stroked along an organ needs some
  /// hundreds, one that slips up to 5,000; only jumps of the device and infeasible contacts reach
  /// the default.
  std::int64_t max_work = 20000;
  /// The fastest that a hand moves a point of the tool, length per time, > 0. A pose farther away
  /// from the last one is an outlier (HapticStatus::Outlier) unless the next one confirms it; then
  /// the tool follows, and the jump counts as no work of the hand. 5 m/s suits hands.
  Scalar largest_device_speed = kInfinity;
};

/// Which contacts HapticSession::find_contacts() looks for.
struct ContactSearch {
  Scalar reach = 0;  ///< largest gap, finite, > 0
  /// How much a neighbouring piece of surface may rise towards the tool beside a contact, as the
  /// sine of its slope, in [0, 1]. 0 finds the local minima of the gap, a larger one more of a
  /// surface that follows the tool's.
  Scalar rise = 0;
  Scalar spread = 0;  ///< contacts of a part are at least so far apart, >= 0; the nearest count
};

namespace haptics_internal {
struct SessionState;
}

/// A tool driven by a device whose next pose is unknown, among tissue and forbidden regions: the
/// proxy ("god object" [Ortega2007]) follows the device as far as its path is proven free, then
/// slides, and the hand feels how far it lags behind.
///
/// Every committed motion is proven by time_of_impact() or a distance bound, for every part of the
/// tool against every tissue and hard region, rotation and deformation included
/// (docs/haptics.md). One thread calls update(); snapshots of a deforming obstacle may
/// come from others, which take turns: update() never waits for them.
///
/// Several tools (HapticScene::more_tools) move at once, proven against each other as well. Tools
/// are numbered from 0, the scene's first one; what takes a number throws InvalidArgument if there
/// is no such tool.
class HapticSession {
 public:
  /// @throws InvalidArgument if the scene or an option is out of its range; the message names it.
  HapticSession(const HapticScene& scene, const HapticOptions& options);
  ~HapticSession();
  HapticSession(HapticSession&&) noexcept;
  HapticSession& operator=(HapticSession&&) noexcept;

  using Deadline = std::optional<std::chrono::steady_clock::time_point>;

  /// One tick: follows the device to its new pose during the time dt, >= 0. Never throws for
  /// anything a device may do: jumps, NaN and odd dt end in a status. Past the deadline the proven
  /// part is kept. Allocates nothing once buffers have grown.
  /// @return The result, which the next call overwrites.
  const HapticTick& update(const DevicePose& device, Scalar dt, const Deadline& deadline = {});

  /// The same with a pose for each tool, and a tick for each. What all share is in all of them:
  /// tissue, time, cutoff, latency and statistics.
  /// @throws InvalidArgument if there are not as many poses as tools.
  std::span<const HapticTick> update(std::span<const DevicePose> devices, Scalar dt,
                                     const Deadline& deadline = {});

  /// The same, cut off where an earlier run with the same inputs was: the same bits.
  const HapticTick& replay(const DevicePose& device, Scalar dt,
                           const std::optional<TickCutoff>& cutoff);
  std::span<const HapticTick> replay(std::span<const DevicePose> devices, Scalar dt,
                                     const std::optional<TickCutoff>& cutoff);

  /// For a replay, between two ticks: takes back what a deforming obstacle waits to start on, and
  /// ends its motion at this fraction, where the next snapshot given sets out: HapticTick::inputs.
  /// @throws InvalidArgument if the obstacle does not deform, or is farther already, or end > 1.
  void replay_turn(std::size_t obstacle, Scalar end);

  /// It has run no tick and been given nothing.
  bool is_fresh() const;
  /// Tells an observer, which may be null, of all that comes, in place of the one before. While no
  /// other thread uses the session.
  /// @throws InvalidArgument if it is not null and the session is not fresh.
  void observe(std::shared_ptr<HapticObserver> observer);
  const std::shared_ptr<HapticObserver>& observer() const;

  /// What the session was made of.
  const HapticScene& scene() const;
  const HapticOptions& options() const;

  /// Other springs from the next tick on; from the thread that calls update(). Along each axis a
  /// lower stiffness takes effect at once, a higher one when the tool is where the device is: so a
  /// change under the hand gives no energy. All else takes effect at once. Limits and dampers of
  /// the hinges stay.
  /// @throws InvalidArgument as the constructor.
  void set_coupling(const CouplingOptions& coupling, std::size_t tool = 0);
  /// The springs that act now.
  const CouplingOptions& coupling(std::size_t tool = 0) const;

  /// Puts a tool elsewhere, as when it is exchanged: no motion, so nothing is proven in between.
  /// What is known of the old place is dropped, and distances are measured at the new one, without
  /// a limit; what the tool starts near or in there it leaves, as after the constructor. Angles of
  /// the pose count. From the thread that calls update().
  /// @throws InvalidArgument if an angle is not finite or a coordinate is beyond the limit of
  ///         give_snapshot().
  void reset(const ToolPose& pose, std::size_t tool = 0);

  const HapticTick& last(std::size_t tool = 0) const;
  /// Elapsed time, the sum of all dt used.
  Scalar time() const;
  bool is_passive() const;
  std::size_t tool_count() const;
  std::size_t obstacle_count() const;

  /// Gives a deforming obstacle the vertices that it shall reach `duration` after those given
  /// before; they move on straight lines. May be called from any thread. Without a next
  /// snapshot, tissue stands still.
  /// @return False if the obstacle has not yet started on the last snapshot; then nothing happens.
  /// @throws InvalidArgument if the obstacle does not deform, the number of vertices differs, one
  ///         is not finite or has a coordinate beyond 2.7e11 rest offsets, or duration is less
  ///         than a millionth of CouplingOptions::period.
  bool give_snapshot(std::size_t obstacle, std::span<const Vector3> vertices, Scalar duration);

  /// From now on a next snapshot should always be there when the obstacle reaches the last one;
  /// HapticTick::tissue_behind tells how much time it has lost because it was not. While no tick
  /// runs. A TissueFeeder expects them.
  /// @throws InvalidArgument if the obstacle does not deform.
  void expect_snapshots(std::size_t obstacle);

  /// Gives a deforming obstacle another mesh, as after a cut, instead of a next snapshot. It takes
  /// over, at rest, in the tick that reaches the last snapshot; snapshots given later move it. May
  /// be called from any thread; the hierarchy is built there.
  ///
  /// The session forgets the old mesh and proves the new one apart from the tool where both stand.
  /// If it cannot, the tool leaves it: HapticStatus::Recovering, Overlapping.
  /// @return As give_snapshot().
  /// @throws InvalidArgument if the obstacle does not deform, there is no triangle, an index is out
  ///         of range, or a vertex is not finite or beyond the same limit.
  bool give_mesh(std::size_t obstacle, std::span<const Vector3> vertices,
                 std::span<const TriangleIndices> triangles);

  /// As give_snapshot(), but the obstacle sets out from where it is, not from the end of its last
  /// motion: that goes on for `lead`, then the vertices are the goal. In place of a snapshot that
  /// was given before and not yet started on. From any thread; a lead that is shorter than this
  /// call, some 5 ms for 50,000 triangles, lets tissue stand until it is through.
  /// @return False if a tick is just about to start on an earlier snapshot, a cut waits, or no tick
  ///         has taken notice yet: then nothing has changed, and the call may be repeated.
  /// @throws InvalidArgument as give_snapshot(), if lead is not finite and >= 0, or for a
  ///         SoftRegion.
  bool retarget(std::size_t obstacle, std::span<const Vector3> vertices, Scalar duration,
                Scalar lead = 0);

  /// Finds the contacts that the tool would have in a pose with a deforming obstacle where a tick
  /// has told it to be: with places, velocities and gaps, without forces (ContactState::Open). Of
  /// parts that cross the obstacle it finds none where they cross. From any thread; uses the boxes
  /// that give_snapshot() has fitted.
  /// @param contacts Replaced, the nearest first.
  /// @return False if the mesh of that progress is no longer there, as newer ones were given.
  /// @throws InvalidArgument if the obstacle does not deform or an option is out of its range.
  bool find_contacts(std::size_t obstacle, const ObstacleProgress& progress, const ToolPose& pose,
                     const ContactSearch& search, std::vector<ToolContactPoint>& contacts,
                     std::size_t tool = 0);

  /// Current vertices of a deforming obstacle.
  /// @throws InvalidArgument if the obstacle does not deform.
  std::vector<Vector3> tissue_vertices(std::size_t obstacle) const;
  /// The number of snapshots and meshes that the obstacle has started on. From any thread.
  std::int64_t snapshots_taken(std::size_t obstacle) const;

 private:
  std::unique_ptr<haptics_internal::SessionState> state_;
};

}  // namespace dyop
