#pragma once

#include "dyop/core/error.h"
#include "dyop/distance/distance.h"

namespace dyop::internal {

/// @throws InvalidArgument for options out of range; the message begins with the subject.
template <typename... Subject>
void require_valid_options(const DistanceOptions& options, const Subject&... subject) {
  DYOP_REQUIRE(options.upper_limit >= 0, subject..., ": upper_limit must be >= 0, not ",
               options.upper_limit);
  DYOP_REQUIRE(options.absolute_allowance >= 0, subject...,
               ": absolute_allowance must be >= 0, not ", options.absolute_allowance);
  DYOP_REQUIRE(options.relative_allowance >= 0 && options.relative_allowance < 1, subject...,
               ": relative_allowance must be in [0, 1), not ", options.relative_allowance);
}

}  // namespace dyop::internal
