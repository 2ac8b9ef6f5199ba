// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/toi/least_distance.h"
#include "dyop/toi/time_of_impact.h"
#include "toi/toi_memory.h"

namespace dyop::toi_internal {

/// Throws InvalidArgument unless both are in range.
void require_valid_distances(Scalar target_distance, std::optional<Scalar> distance_tolerance);

/// What the default tolerance of a query with this shape goes by. More than Shape::size(): far from
/// their frame's origin, as in map coordinates, meshes need it to stay above the rounding of their
/// poses.
Scalar size_of(const Shape& shape);

/// default_distance_tolerance() of shapes of these sizes.
Scalar tolerance_for_sizes(Scalar a, Scalar b);

/// The tolerance of a query of shapes of these sizes.
Scalar tolerance_of(const ToiOptions& options, Scalar size_a, Scalar size_b);

/// Throws InvalidArgument unless all numbers in the options are in range.
void require_valid_options(const ToiOptions& options);

/// Throws InvalidArgument unless time_of_impact() can answer this query.
void require_valid_query(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                         const TimeInterval& interval, const ToiOptions& options);

/// Throws InvalidArgument unless the memory holds an unfinished query about this subject.
void require_resumable(const ToiMemory& memory, const ToiSubject& subject);

/// Throws InvalidArgument unless all numbers in the options are in range.
void require_valid_options(const LeastDistanceOptions& options);

/// How far apart the bounds of a result may stay.
Scalar tolerance_of(const LeastDistanceOptions& options, const LeastDistanceResult& result);

}  // namespace dyop::toi_internal
