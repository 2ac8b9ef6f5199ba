// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>

#include "dyop/haptics/haptic_runner.h"
#include "dyop/io/haptic_scene_file.h"
#include "dyop/view/page_encoder.h"

namespace DYOP_EXPORT dyop {

/// Collects the data of a page from a haptic run while it goes on: at most 60 pictures per second
/// of the session's time, each with the extremes of the ticks since the one before.
///
/// The loop knows nothing of it. run_session() hands ticks to its log without waiting; the log
/// hands pictures to a thread of the follower, which publishes them. While that thread is busy,
/// ticks go into a later picture, and snapshots of tissue beyond a limit are left out: no thread of
/// the run ever waits for a page.
class ToolFollower {
 public:
  /// What a page shows of a scene before anything moves. PageScene::keeps_time is set.
  static PageScene scene_of(const HapticRun& run);

  /// @param run     Is copied. Shapes of its feeds are computed once more from their formulas.
  /// @param publish Called in the follower's thread with what happened next; it may be slow, and
  ///                must not throw.
  /// @throws FileError for a formula that no scene can hold.
  ToolFollower(const HapticRun& run, std::function<void(PageSpan)> publish);
  /// As finish("").
  ~ToolFollower();
  ToolFollower(const ToolFollower&) = delete;
  ToolFollower& operator=(const ToolFollower&) = delete;

  /// For the sink of run_session(): a tick. Never waits.
  void add(const TickRecord& record);
  /// For TissueFeed::given: a model's next snapshot, from the thread of tissue.
  void add_snapshot(std::size_t obstacle, std::span<const Vector3> vertices);
  /// For TissueFeed::given_mesh: a model has cut an obstacle, which goes on as this mesh.
  void add_cut(std::size_t obstacle, const TissueMesh& mesh);
  /// Publishes the rest and, unless it is empty, why the run ended; waits for `publish`.
  void finish(const std::string& why);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dyop
