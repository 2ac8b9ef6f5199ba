// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "dyop/core/error.h"

namespace DYOP_EXPORT dyop {

/// A place in a text file; lines and columns count from 1.
struct FilePosition {
  std::size_t line = 0;
  std::optional<std::size_t> column;
};

/// A file that cannot be read, written or understood. The message is one line:
/// `<file>[:<line>[:<column>]]: <expected and found>`.
class FileError : public Error {
 public:
  FileError(const std::filesystem::path& file, const std::string& problem);
  FileError(const std::filesystem::path& file, const FilePosition& position,
            const std::string& problem);

  const std::filesystem::path& file() const { return file_; }
  const std::optional<FilePosition>& position() const { return position_; }

 private:
  std::filesystem::path file_;
  std::optional<FilePosition> position_;
};

/// A file that is to be read and is not there.
class MissingFile : public FileError {
 public:
  explicit MissingFile(const std::filesystem::path& file) : FileError(file, "no such file") {}
};

}  // namespace dyop
