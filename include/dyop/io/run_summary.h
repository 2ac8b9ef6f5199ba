// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "dyop/dynamics/world.h"
#include "dyop/io/scene_file.h"

namespace DYOP_EXPORT dyop {

/// Sums over the advances of a run, and how it ended.
struct RunTotals {
  AdvanceStatus status = AdvanceStatus::NotRun;
  Scalar t = 0;  ///< where the run ended
  std::int64_t advances = 0;
  std::int64_t steps = 0;  ///< committed steps
  std::int64_t impacts = 0;
  std::vector<std::pair<BodyId, BodyId>> too_near;
  std::pair<BodyId, BodyId> offending_pair;  ///< as AdvanceReport
  IntegratorStatistics integrator;
  ToiStatistics toi;  ///< peak_queue is the largest
  StepStatistics work;
  StepTimes times;  ///< not recorded: a recording knows no clock
  /// What World::advance() threw, if that ended the run; `status` is then that of the previous
  /// advance.
  std::optional<std::string> error;

  void add(const AdvanceReport& report);

  /// How the run ended in one word: the name of the status, or "Error".
  std::string_view end() const;
};

/// A report of a run for people to read. Only here is the clock shown.
/// @param impacts      All impacts of the run, in order; the first ones are printed in full.
/// @param wall_seconds Time spent on the run.
void write_summary(std::ostream& out, const Scene& scene, const std::vector<ImpactEvent>& impacts,
                   const RunTotals& totals, double wall_seconds);

/// How a run ended, in one sentence.
std::string describe_end(const Scene& scene, const RunTotals& totals);

}  // namespace dyop
