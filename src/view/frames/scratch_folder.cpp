// SPDX-License-Identifier: BSD-3-Clause
#include "view/frames/scratch_folder.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "dyop/io/file_error.h"

namespace dyop::view_internal {

ScratchFolder::ScratchFolder(const std::string& use) {
  // mkdtemp() replaces the six letters at the end.
  const std::string pattern = "dyop-" + use + "-" + std::string(6, 'X');
  std::string name = (std::filesystem::temp_directory_path() / pattern).string();
  if (mkdtemp(name.data()) == nullptr) {
    throw FileError(name, std::string("could not be created: ") + std::strerror(errno));
  }
  path_ = name;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace dyop::view_internal
