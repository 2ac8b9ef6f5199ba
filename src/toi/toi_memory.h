// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>

#include "distance/distance_traversal.h"
#include "distance/gjk/warm_gjk.h"
#include "distance/piece_distance.h"
#include "dyop/toi/time_of_impact.h"
#include "toi/radix_queue.h"

namespace dyop::toi_internal {

/// What a query is about: a resumed one must be about the same.
struct ToiSubject {
  // The sides are compared by address only: shapes or deforming meshes.
  const void* a = nullptr;
  const Motion* X_WA = nullptr;  // none for a deforming mesh
  const void* b = nullptr;
  const Motion* X_WB = nullptr;
  TimeInterval interval;
  Scalar target_distance = 0;
  std::optional<Scalar> distance_tolerance;

  ToiSubject() = default;
  ToiSubject(const void* side_a, const Motion* motion_a, const void* side_b, const Motion* motion_b,
             const TimeInterval& the_interval, const ToiOptions& options)
      : a(side_a),
        X_WA(motion_a),
        b(side_b),
        X_WB(motion_b),
        interval(the_interval),
        target_distance(options.target_distance),
        distance_tolerance(options.distance_tolerance) {}

  friend bool operator==(const ToiSubject&, const ToiSubject&) = default;
};

/// The contents of a ToiWorkspace.
struct ToiMemory {
  RadixQueue queue;
  GjkSeed seed;   // of the last distance of two convex shapes
  GjkSeed start;  // what the next query begins with; used up by it
  // State of the search for a nearer pair than two pieces in contact; an unfinished one goes on.
  BoxPairStack box_pairs;
  PieceDistance nearer;
  bool is_seeking_nearer = false;
  bool has_resting_pair = false;  // some pair of pieces was in contact, but not as an impact
  ToiSubject subject;
  bool is_unfinished = false;
  Scalar standing_time = 0;  // of an unfinished query: the current time of the sides
  std::atomic<bool> is_in_use{false};

  /// As after a query that ended decided and left nothing to the next one.
  void forget() {
    is_unfinished = false;
    start.count = 0;
    seed.count = 0;
  }
};

/// Reserves a workspace for one query.
class WorkspaceUse {
 public:
  /// @throws InvalidArgument if another query uses it.
  explicit WorkspaceUse(ToiWorkspace& workspace);
  ~WorkspaceUse() { memory_.is_in_use.store(false, std::memory_order_release); }
  WorkspaceUse(const WorkspaceUse&) = delete;
  WorkspaceUse& operator=(const WorkspaceUse&) = delete;

  ToiMemory& memory() const { return memory_; }

 private:
  ToiMemory& memory_;
};

}  // namespace dyop::toi_internal
