// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "paper/experiment/paper_experiment.h"

namespace dyop::cli {

/// The results as Markdown tables that are also readable as plain text.
DYOP_EXPORT std::string describe_paper(const PaperResults& results);

/// One line per object, algorithm and series: times, gains of certified DyOP, errors.
DYOP_EXPORT std::string paper_times_csv(const PaperResults& results);

/// One line per test: vertices to the last digit, proven bounds, and every algorithm's value.
DYOP_EXPORT std::string paper_tests_csv(const PaperResults& results);

/// Summary as one JSON object: settings, and one row per algorithm and series.
DYOP_EXPORT std::string paper_json(const PaperResults& results);

}  // namespace dyop::cli
