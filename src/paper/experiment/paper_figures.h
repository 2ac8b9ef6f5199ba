// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "paper/experiment/paper_experiment.h"

namespace dyop::cli {

/// Figure 4 of [DyOP] as SVG: the time of one query per object and algorithm, with quartiles, and
/// below each object the number of its 9 tests that an algorithm got wrong.
DYOP_EXPORT std::string draw_times(const PaperSeries& series, const PaperSettings& settings);

/// Figure 5 of [DyOP] as SVG: the percentage by which DyOP, certified and as published, is faster
/// than GJK and than Lin-Canny, per object, with the range that the paper reports.
DYOP_EXPORT std::string draw_gains(const PaperSeries& series, const PaperSettings& settings);

}  // namespace dyop::cli
