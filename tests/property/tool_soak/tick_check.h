// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "dyop/haptics/haptic_session.h"
#include "span_oracle.h"

namespace dyop::testing {

/// What was checked, and which promises were broken.
struct TickFindings {
  std::int64_t near = 0, samples = 0;
  Scalar least_excess = kInfinity;  ///< over the margin
  std::int64_t breaches = 0;
  std::int64_t unproven = 0;  ///< between samples
  std::int64_t wrong_clearances = 0, wrong_tissue = 0, wrong_statuses = 0;
  std::int64_t early_breaches = 0;  ///< before the session's time to breach

  std::int64_t broken() const {
    return breaches + unproven + wrong_clearances + wrong_tissue + wrong_statuses + early_breaches;
  }
};

/// Looks over the shoulder of a tool session: samples every committed motion of every part of the
/// tool against every obstacle's motion, more densely the nearer they are, and compares what the
/// tick reports with what it finds (docs/haptics.md, "What is promised").
class TickCheck {
 public:
  TickCheck(const HapticScene& scene, const HapticOptions& options);

  /// What the session was given, in the same order.
  TissuePath& tissue(std::size_t obstacle) { return tissue_[obstacle]; }
  /// After every update().
  void check(const HapticSession& session, const DevicePose& device, Scalar dt);

  TickFindings findings;

 private:
  struct Start {
    Scalar least_excess;  // of a motion of the tick over the margin
    Scalar least;
  };

  void check_part(const SpanPart& part);
  void check_pair(std::size_t obstacle, std::size_t body, const SpanPart& part);
  void check_clearances();
  void check_time_to_breach(Scalar dt);
  void check_tissue(const HapticSession& session);
  void check_status(const DevicePose& device, Scalar dt);
  bool is_exempt() const;
  void tell(const char* what, std::size_t obstacle, Scalar value, Scalar bound) const;

  const std::vector<ToolObstacle> obstacles_;
  const HapticOptions options_;
  SpanOracle oracle_;
  std::vector<TissuePath> tissue_;
  // The current tick.
  std::int64_t number_ = 0;
  const HapticTick* tick_ = nullptr;
  std::vector<Scalar> distance_;  // of each obstacle at the end, at most the cap
  Start start_{};
};

}  // namespace dyop::testing
