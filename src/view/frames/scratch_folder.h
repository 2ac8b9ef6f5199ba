// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

namespace dyop::view_internal {

/// A fresh folder for temporary files, removed with everything in it.
class DYOP_EXPORT ScratchFolder {
 public:
  /// Throws FileError if it cannot be created. `use` is part of its name.
  explicit ScratchFolder(const std::string& use);
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace dyop::view_internal
