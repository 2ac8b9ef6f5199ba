// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::cli {

/// How wrong published DyOP is on random triangles at one gap.
struct GapErrors {
  int dimension = 2;
  Scalar gap = 0;
  int pairs = 0;
  int wrong = 0;           ///< value off by more than kWrongBy
  Scalar mean_factor = 1;  ///< value over true distance, where wrong
  Scalar worst_factor = 1;
};

/// Random triangles in [-1, 1]^2 and [-1, 1]^3, moved to each gap along the line of their nearest
/// points; `pairs` of them per row.
std::vector<GapErrors> measure_gap_errors(std::uint64_t seed, int pairs);

}  // namespace dyop::cli
