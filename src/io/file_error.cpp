// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/file_error.h"

namespace dyop {
namespace {

// One printable line, whatever bytes of the file are quoted in it.
std::string printable(std::string message) {
  for (char& c : message) {
    if (static_cast<unsigned char>(c) < ' ' || c == 0x7f) c = '?';
  }
  return message;
}

std::string describe(const std::filesystem::path& file, const FilePosition& position,
                     const std::string& problem) {
  if (!position.column) {
    return core_internal::compose_message(file.string(), ':', position.line, ": ", problem);
  }
  return core_internal::compose_message(file.string(), ':', position.line, ':', *position.column,
                                        ": ", problem);
}

}  // namespace

FileError::FileError(const std::filesystem::path& file, const std::string& problem)
    : Error(printable(file.string() + ": " + problem)), file_(file) {}

FileError::FileError(const std::filesystem::path& file, const FilePosition& position,
                     const std::string& problem)
    : Error(printable(describe(file, position, problem))), file_(file), position_(position) {}

}  // namespace dyop
