// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/toi/least_distance.h"

namespace dyop::toi_internal {

/// Throws InvalidArgument unless all numbers in the options are in range.
void require_valid_options(const LeastDistanceOptions& options);

/// How far apart the bounds of a result may stay.
Scalar tolerance_of(const LeastDistanceOptions& options, const LeastDistanceResult& result);

}  // namespace dyop::toi_internal
