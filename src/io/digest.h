// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "dyop/core/export.h"

namespace dyop::io_internal {

/// FNV-1a, 64 bits: any one changed byte changes it. It guards against damage, not against
/// forgers.
DYOP_EXPORT std::uint64_t digest_of(std::string_view bytes);

/// The same over numbers.
DYOP_EXPORT std::uint64_t digest_of(std::span<const std::uint64_t> words);

/// Sixteen digits.
DYOP_EXPORT std::string hex_digits(std::uint64_t value);

}  // namespace dyop::io_internal
