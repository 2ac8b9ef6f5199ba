// SPDX-License-Identifier: BSD-3-Clause
#include "view/page_bytes.h"

namespace dyop::internal {

std::string_view page_bytes() {
  return {};
}

}  // namespace dyop::internal
