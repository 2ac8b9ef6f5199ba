// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "dyop/dynamics/world.h"
#include "dyop/view/page_encoder.h"

namespace DYOP_EXPORT dyop {

/// Collects the data of a page from a World while it runs.
class RunFollower {
 public:
  /// The World's bodies at its time; `end_time` is what is planned.
  static PageScene scene_of(const World& world, const std::string& title, const Vector3& gravity_W,
                            Scalar end_time);

  /// @param gravity_W For the potential energy.
  explicit RunFollower(const Vector3& gravity_W) : gravity_W_(gravity_W) {}

  /// Where the bodies are before the first advance, for a page that opens before its end.
  static PageSpan start(const World& world);
  /// The data of the last advance of `world`. To be called after each advance.
  PageSpan follow(const AdvanceReport& report, const World& world);
  /// After the last advance, which had this status: why the run ended.
  static PageSpan ended(const World& world, AdvanceStatus status, Scalar planned_end);

 private:
  void add_segments(const AdvanceReport& report, PageSpan& span);
  void add_frame(const AdvanceReport& report, const World& world, PageSpan& span);
  void add_pairs(const World& world, PageSpan& span);
  void add_marks(const AdvanceReport& report, const World& world, PageSpan& span) const;

  Vector3 gravity_W_;
  bool has_started_ = false;
  std::vector<std::shared_ptr<const Motion>> rests_;  // by slot: what the page knows already
  std::vector<std::pair<BodyId, BodyId>> resting_;    // sorted
};

}  // namespace dyop
