// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "paper/experiment/paper_experiment.h"
#include "paper/experiment/paper_tests.h"

namespace dyop::cli {

/// Figure 4 of [DyOP] as SVG: the time of one query per object and algorithm, with quartiles, and
/// below each object the number of its 9 tests that an algorithm got wrong.
DYOP_EXPORT std::string draw_times(const PaperSeries& series, const PaperSettings& settings);

/// Figure 5 of [DyOP] as SVG: the percentage by which DyOP, certified and as published, is faster
/// than GJK and than Lin-Canny, per object, with the range that the paper reports.
DYOP_EXPORT std::string draw_gains(const PaperSeries& series, const PaperSettings& settings);

/// Figures 2 and 3 of [DyOP] as SVG: both boxes, the internal box, the pivot, the vertices kept,
/// and the shortest segment between them beside the true one. In space, seen from above a corner.
template <int dimension>
DYOP_EXPORT std::string draw_construction(const PaperTest<dimension>& test);

/// The results as Markdown tables that are also readable as plain text.
DYOP_EXPORT std::string describe_paper(const PaperResults& results);

/// One line per object, algorithm and series: times, gains of certified DyOP, errors.
DYOP_EXPORT std::string paper_times_csv(const PaperResults& results);

/// One line per test: vertices to the last digit, proven bounds, and every algorithm's value.
DYOP_EXPORT std::string paper_tests_csv(const PaperResults& results);

/// Summary as one JSON object: settings, and one row per algorithm and series.
DYOP_EXPORT std::string paper_json(const PaperResults& results);

}  // namespace dyop::cli
