// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "paper/experiment/paper_tests.h"

namespace dyop::cli {

/// Figures 2 and 3 of [DyOP] as SVG: both boxes, the internal box, the pivot, the vertices kept,
/// and the shortest segment between them beside the true one. In space, seen from above a corner.
template <int dimension>
DYOP_EXPORT std::string draw_construction(const PaperTest<dimension>& test);

}  // namespace dyop::cli
