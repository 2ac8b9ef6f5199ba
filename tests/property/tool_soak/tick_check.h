// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "dyop/haptics/haptic_session.h"
#include "span_oracle.h"

namespace dyop::testing {

inline constexpr Scalar kRounding = 1e-7;    // literal: of numbers of size 300
inline constexpr Scalar kResolution = 2e-3;  // between samples where the margin is not yet proven
inline constexpr Scalar kLook = 0.3;         // pairs of triangles nearer than this are measured

/// Distances at the starts of the motions of a tick, of what is kept apart.
struct SpanStart {
  Scalar least_excess = kInfinity;  ///< over the margin
  Scalar least = kInfinity;

  void add(Scalar start, Scalar margin) {
    least = std::min(least, start);
    least_excess = std::min(least_excess, start - margin);
  }
};

/// What a motion that starts at a distance must keep, besides rounding (docs/haptics.md).
Scalar promised_distance(Scalar start, Scalar margin, Scalar rest_offset);
/// Whether it starts where the whole promise holds.
bool has_full_promise(Scalar start, Scalar margin, Scalar rest_offset);

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
  TickFindings& operator+=(const TickFindings& other) {
    near += other.near;
    samples += other.samples;
    least_excess = std::min(least_excess, other.least_excess);
    breaches += other.breaches;
    unproven += other.unproven;
    wrong_clearances += other.wrong_clearances;
    wrong_tissue += other.wrong_tissue;
    wrong_statuses += other.wrong_statuses;
    early_breaches += other.early_breaches;
    return *this;
  }
};

/// Looks over the shoulder of a tool session: samples every committed motion of every part of the
/// tool against every obstacle's motion, more densely the nearer they are, and compares what the
/// tick reports with what it finds (docs/haptics.md, "What is promised").
class TickCheck {
 public:
  /// Of one of the scene's tools.
  TickCheck(const HapticScene& scene, const HapticOptions& options, std::size_t tool);

  /// What the session was given, in the same order.
  TissuePath& tissue(std::size_t obstacle) { return tissue_[obstacle]; }
  /// After every update().
  /// @param beside What the tool was kept apart from besides obstacles.
  void check(const HapticSession& session, const DevicePose& device, Scalar dt,
             const SpanStart& beside);

  TickFindings findings;

 private:
  bool take_over_at_end(const HapticSession& session, Scalar dt);
  void check_part(const SpanPart& part);
  void check_pair(std::size_t obstacle, std::size_t body, const SpanPart& part);
  void check_clearances();
  void check_time_to_breach(Scalar dt);
  void check_tissue(const HapticSession& session);
  void check_status(const DevicePose& device, Scalar dt);
  bool is_exempt() const;
  void tell(const char* what, std::size_t obstacle, Scalar value, Scalar bound) const;

  const std::size_t tool_;
  const std::vector<ToolObstacle> obstacles_;
  const HapticOptions options_;
  SpanOracle oracle_;
  std::vector<TissuePath> tissue_;
  // The current tick.
  std::int64_t number_ = 0;
  const HapticTick* tick_ = nullptr;
  std::vector<Scalar> distance_;  // of each obstacle at the end, at most the cap
  SpanStart start_;
};

}  // namespace dyop::testing
