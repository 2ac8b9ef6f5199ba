// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace dyop::testing {

/// Allocations by operator new in this executable so far. In a file of its own, so that no
/// compiler sees the replaced operators beside what calls them.
std::int64_t allocation_count();

}  // namespace dyop::testing
