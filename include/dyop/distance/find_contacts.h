// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <stop_token>
#include <vector>

#include "dyop/distance/distance.h"

namespace DYOP_EXPORT dyop {

/// What ends a search for contacts early.
struct ContactSearchLimits {
  /// Pairs of triangles within max_distance, at most; >= 0. Each takes some kilobytes meanwhile.
  std::int64_t max_triangle_pairs = std::numeric_limits<std::int64_t>::max();
  /// Cooperative cancellation.
  std::stop_token stop = {};
};

/// find_contacts() under limits: nothing if one of them ended the search, because contacts that are
/// not all there are not the nearest ones of their places.
/// @throws InvalidArgument likewise, or if max_triangle_pairs is negative.
std::optional<std::vector<Contact>> find_contacts(const Shape& a, const RigidPose& X_WA,
                                                  const Shape& b, const RigidPose& X_WB,
                                                  Scalar max_distance,
                                                  const ContactSearchLimits& limits);

}  // namespace dyop
