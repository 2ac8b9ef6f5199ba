// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "dyop/toi/time_of_impact.h"

namespace dyop::cli {

/// The distance of two moving shapes at a time, with its bounds.
struct GapSample {
  Scalar t = 0;
  Scalar lower = 0;
  Scalar upper = 0;
};

/// One step of conservative advancement: from t on the gap is at least
/// `lower` - `speed` * (time - t), up to t + length.
struct GapStep {
  Scalar t = 0;
  Scalar length = 0;
  Scalar lower = 0;
  Scalar speed = 0;  ///< bound of the closing speed
};

struct GapHistory {
  std::vector<GapSample> samples;
  std::vector<GapStep> steps;
  bool is_cut = false;  ///< there would be more steps
};

/// Samples the distance over the interval, and advances conservatively from its start with the
/// motions' bounds until the gap is within the target and `tolerance`.
/// @param sample_count At least 2.
GapHistory gap_history(const ToiQuery& query, Scalar tolerance, int sample_count, int most_steps);

}  // namespace dyop::cli
