#pragma once

#include "dyop/toi/time_of_impact.h"

namespace dyop::internal {

/// Throws InvalidArgument unless time_of_impact() can answer this query.
void require_valid_query(const Motion& X_WA, const Motion& X_WB, const TimeInterval& interval,
                         const ToiOptions& options);

}  // namespace dyop::internal
