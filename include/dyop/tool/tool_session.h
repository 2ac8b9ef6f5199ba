// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <span>

#include "dyop/tool/tool_scene.h"
#include "dyop/tool/tool_tick.h"
#include "dyop/tool/virtual_coupling.h"

namespace DYOP_EXPORT dyop {

struct ToolOptions {
  CouplingOptions coupling;
  /// Resting contact keeps the obstacle's margin plus the standoff; the motion is proven never to
  /// come within margin plus a small part of it. Length, > 0; smaller: a thinner gap, at the cost of
  /// more rounds on curved surfaces. A hundredth of the tool's thickness works well.
  Scalar standoff = 0;
  /// How fast the tool leaves what it begins in, length per time, > 0.
  Scalar recovery_speed = 0;
  int max_rounds = 4;     ///< motions a tick, >= 1
  int max_attempts = 4;   ///< contacts added and solved again for a motion, >= 1
  int max_contacts = 24;  ///< per motion, >= 1
  /// How far the bounds of a clearance may be apart, relative to it, besides the standoff; > 0.
  Scalar clearance_tolerance = 0.02;
};

namespace internal {
struct SessionState;
}

/// A tool driven by a device whose next pose nobody knows, among tissue and forbidden regions: the
/// proxy ("god object" [Ortega2007]) follows the device as far as that is proven to be free, then
/// slides, and the hand feels how far it is behind.
///
/// Every committed motion is proven by time_of_impact() or a distance bound, for every part of the
/// tool against every tissue and hard region, rotation and deformation included
/// (docs/algorithms/tool_loop.md). One thread calls update(); snapshots of a deforming obstacle may
/// come from another one.
class ToolSession {
 public:
  /// @throws InvalidArgument if the scene or an option is out of its range; the message names it.
  ToolSession(const ToolScene& scene, const ToolOptions& options);
  ~ToolSession();
  ToolSession(ToolSession&&) noexcept;
  ToolSession& operator=(ToolSession&&) noexcept;

  using Deadline = std::optional<std::chrono::steady_clock::time_point>;

  /// One tick: follows the device to its new pose during the time dt, >= 0. Never throws for what a
  /// device may do: jumps, NaN and odd dt end in a status. Past the deadline the proven part is
  /// kept. Allocates nothing once buffers have grown.
  /// @return The result, which is overwritten by the next call.
  const ToolTick& update(const DevicePose& device, Scalar dt, const Deadline& deadline = {});

  /// The same, cut off where an earlier run of the same inputs was: the same bits.
  const ToolTick& replay(const DevicePose& device, Scalar dt,
                         const std::optional<TickCutoff>& cutoff);

  const ToolTick& last() const;
  /// Time that has passed, the sum of all dt that were used.
  Scalar time() const;
  bool is_passive() const;
  std::size_t obstacle_count() const;

  /// Gives a deforming obstacle the vertices that it is to reach `duration` after it has reached
  /// those given before; they move on straight lines. May be called from one other thread. Without a
  /// next snapshot, tissue stands still.
  /// @return False if the obstacle has not yet taken the last snapshot; then nothing happens.
  /// @throws InvalidArgument if the obstacle does not deform, the number of vertices differs, one is
  ///         not finite, or duration is not > 0.
  bool give_snapshot(std::size_t obstacle, std::span<const Vector3> vertices, Scalar duration);

  /// Vertices of a deforming obstacle where it stands.
  /// @throws InvalidArgument if the obstacle does not deform.
  std::vector<Vector3> tissue_vertices(std::size_t obstacle) const;
  /// The number of snapshots that the obstacle has started on.
  std::int64_t snapshots_taken(std::size_t obstacle) const;

 private:
  std::unique_ptr<internal::SessionState> state_;
};

}  // namespace dyop
