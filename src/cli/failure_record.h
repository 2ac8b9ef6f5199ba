// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>

#include "dyop/toi/time_of_impact.h"
#include "dyop/toi/toi_result.h"

namespace dyop::cli {

/// Returns ask(), which answers `query`. If that fails through no fault of the caller, the query is
/// first written to `record_file` (dyop-failure.json if that is empty).
/// @throws InternalError with the name of the record for such a failure; other errors of dyop
///         unchanged.
ToiResult answer_or_record(const ToiQuery& query, const std::string& record_file,
                           const std::function<ToiResult()>& ask);

}  // namespace dyop::cli
