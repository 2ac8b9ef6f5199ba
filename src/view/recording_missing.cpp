// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/core/error.h"
#include "dyop/view/page_file.h"

namespace dyop {

std::string recorded_page_html(const std::filesystem::path&, const RecordedPageOptions&) {
  throw InvalidArgument("this dyop was built without HDF5, so it reads no recordings");
}

}  // namespace dyop
