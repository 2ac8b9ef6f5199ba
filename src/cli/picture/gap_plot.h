// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cli/picture/gap_history.h"
#include "cli/picture/pair_view.h"

namespace dyop::cli {

/// Draws the gap over time, the steps of conservative advancement below it, and what the query
/// proved: up to t_safe, and the bracket that ends with t_hit.
void draw_gap(SvgCanvas& canvas, const Panel& panel, const ToiQuery& query, const ToiResult& result,
              const GapHistory& history);

}  // namespace dyop::cli
