// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <iosfwd>
#include <vector>

#include "dyop/io/run_recording.h"

namespace DYOP_EXPORT dyop {

/// A report of a run for people to read. Only here is the clock shown.
/// @param impacts      All impacts of the run, in order; the first ones are printed in full.
/// @param wall_seconds Time spent on the run.
void write_summary(std::ostream& out, const Scene& scene, const std::vector<ImpactEvent>& impacts,
                   const RunTotals& totals, double wall_seconds);

/// How a run ended, in one sentence.
std::string describe_end(const Scene& scene, const RunTotals& totals);

}  // namespace dyop
