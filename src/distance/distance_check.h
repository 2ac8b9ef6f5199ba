// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/distance/ray_cast.h"

namespace dyop::distance_internal {

/// @throws InvalidArgument for options out of range; the message starts with the subject.
template <typename... Subject>
void require_valid_options(const DistanceOptions& options, const Subject&... subject) {
  DYOP_REQUIRE(options.max_distance >= 0, subject..., ": max_distance must be >= 0, not ",
               options.max_distance);
  DYOP_REQUIRE(options.absolute_tolerance >= 0, subject...,
               ": absolute_tolerance must be >= 0, not ", options.absolute_tolerance);
  DYOP_REQUIRE(options.relative_tolerance >= 0 && options.relative_tolerance < 1, subject...,
               ": relative_tolerance must be in [0, 1), not ", options.relative_tolerance);
}

/// @throws InvalidArgument, prefixed with the name of the query, for a ray that ray_cast() refuses.
DYOP_EXPORT void require_valid_ray(const Ray& ray, const char* query);

}  // namespace dyop::distance_internal
