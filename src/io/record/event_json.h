// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/dynamics/world.h"
#include "io/json_reader.h"

namespace dyop::io_internal {

/// Reports of a World as JSON values.
Json to_json(const BodyId& id);
Json to_json(const IntegratorStatistics& statistics);
Json to_json(const StepStatistics& statistics);
/// Without the contacts of the time of impact: the event lists those of all pairs.
Json to_json(const ImpactEvent& event);

}  // namespace dyop::io_internal
