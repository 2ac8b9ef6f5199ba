// SPDX-License-Identifier: BSD-3-Clause
#include "view/page_bytes.h"

namespace dyop::view_internal {

std::string_view page_bytes() {
  return {};
}

}  // namespace dyop::view_internal
