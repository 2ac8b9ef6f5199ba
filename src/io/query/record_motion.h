// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "dyop/motion/motion.h"
#include "io/json_reader.h"

namespace dyop::io_internal {

/// The object "motion" of docs/formats.md.
///
/// To add a motion: one entry in the table of record_motion.cpp.
/// @throws InvalidArgument for a motion that is not one of dyop's, or is made of user functions.
DYOP_EXPORT Json record_motion(const Motion& motion);

/// Throws FileError.
DYOP_EXPORT std::shared_ptr<const Motion> recorded_motion(const JsonNode& node);

}  // namespace dyop::io_internal
