// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "check/trusted/hdf5_table.h"

/// Damage after a file was written. What is proven is proven of what the file says now.
namespace dyop_check {

/// The first dataset of which a block of rows is not what its digest in `/digests` says; nothing if
/// there is none, or the file has no digests, as that of a run that goes on.
std::optional<std::string> find_damage(const Hdf5Reader& file);

}  // namespace dyop_check
