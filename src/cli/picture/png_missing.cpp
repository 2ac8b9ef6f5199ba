// SPDX-License-Identifier: BSD-3-Clause
#include "cli/picture/query_picture.h"
#include "dyop/io/file_error.h"

namespace dyop::cli {

std::string png_of(const std::filesystem::path& file, const std::string&) {
  throw FileError(file,
                  "this dyop was built without librsvg (on Debian: librsvg2-dev); "
                  ".svg and .html need nothing");
}

}  // namespace dyop::cli
