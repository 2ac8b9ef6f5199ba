// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

namespace dyop::view_internal {

/// The bundled page, or nothing if dyop was built without it.
std::string_view page_bytes();

}  // namespace dyop::view_internal
