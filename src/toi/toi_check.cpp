// SPDX-License-Identifier: BSD-3-Clause
#include "toi/toi_check.h"

#include <algorithm>

#include "core/tolerance.h"
#include "distance/point_search.h"
#include "dyop/core/error.h"

namespace dyop {

Scalar default_distance_tolerance(const Shape& a, const Shape& b) {
  return toi_internal::tolerance_for_sizes(toi_internal::size_of(a), toi_internal::size_of(b));
}

}  // namespace dyop

namespace dyop::toi_internal {

void require_valid_distances(Scalar target_distance, std::optional<Scalar> distance_tolerance) {
  DYOP_REQUIRE(target_distance >= 0 && target_distance < kInfinity,
               "time_of_impact: target_distance must be finite and >= 0, not ", target_distance);
  DYOP_REQUIRE(!distance_tolerance || (*distance_tolerance > 0 && *distance_tolerance < kInfinity),
               "time_of_impact: distance_tolerance must be finite and > 0, not ",
               *distance_tolerance);
}

Scalar size_of(const Shape& shape) {
  return std::min(shape.bounding_radius(), 2 * shape.bounding_box().diagonal().norm());
}

Scalar tolerance_for_sizes(Scalar a, Scalar b) {
  const auto [smaller, larger] = std::minmax(a, b);
  // A half-space has no size either.
  const Scalar size = smaller > 0 ? smaller : larger < kLargestCoordinate ? larger : 0;
  DYOP_REQUIRE(size > 0, "time_of_impact: distance_tolerance is required for shapes without size");
  return kDefaultRelativeTolerance * size;
}

Scalar tolerance_of(const ToiOptions& options, Scalar size_a, Scalar size_b) {
  return options.distance_tolerance ? *options.distance_tolerance
                                    : tolerance_for_sizes(size_a, size_b);
}

void require_valid_options(const ToiOptions& options) {
  require_valid_distances(options.target_distance, options.distance_tolerance);
  DYOP_REQUIRE(options.max_node_pairs > 0, "time_of_impact: max_node_pairs must be > 0, not ",
               options.max_node_pairs);
}

void require_valid_query(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                         const TimeInterval& interval, const ToiOptions& options) {
  require_valid(interval, "time_of_impact: interval");
  require_defined(X_WA, interval, "time_of_impact: the motion of A");
  require_defined(X_WB, interval, "time_of_impact: the motion of B");
  require_valid_options(options);
  require_closed("time_of_impact", a, b, {options.solid_a, options.solid_b});
}

void require_resumable(const ToiMemory& memory, const ToiSubject& subject) {
  DYOP_REQUIRE(memory.is_unfinished, "resume_time_of_impact: the workspace holds no undecided ",
               "query");
  DYOP_REQUIRE(memory.subject == subject, "resume_time_of_impact: shapes, motions, interval, ",
               "target and tolerance must be those of the resumed query");
}

}  // namespace dyop::toi_internal
