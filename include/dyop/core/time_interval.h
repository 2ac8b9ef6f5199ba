// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "dyop/core/error.h"
#include "dyop/core/types.h"

namespace DYOP_EXPORT dyop {

/// A span of time [begin, end], in the unit of time that velocities use.
struct TimeInterval {
  Scalar begin = 0;
  Scalar end = 1;

  Scalar length() const { return end - begin; }
  bool contains(Scalar t) const { return begin <= t && t <= end; }

  friend bool operator==(const TimeInterval&, const TimeInterval&) = default;
};

/// Throws InvalidArgument unless both ends are finite and begin <= end. `what` names the interval.
inline void require_valid(const TimeInterval& interval, const char* what = "time interval") {
  DYOP_REQUIRE(std::isfinite(interval.begin) && std::isfinite(interval.end), what,
               " must be finite, not [", interval.begin, ", ", interval.end, "]");
  DYOP_REQUIRE(interval.begin <= interval.end, what, " must not be reversed: begin ",
               interval.begin, " > end ", interval.end);
}

}  // namespace dyop
