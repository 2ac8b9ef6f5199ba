#include "dyop/io/file_error.h"

namespace dyop {
namespace {

std::string describe(const std::filesystem::path& file, const FilePosition& position,
                     const std::string& problem) {
  if (!position.column) {
    return internal::compose_message(file.string(), ':', position.line, ": ", problem);
  }
  return internal::compose_message(file.string(), ':', position.line, ':', *position.column, ": ",
                                   problem);
}

}  // namespace

FileError::FileError(const std::filesystem::path& file, const std::string& problem)
    : Error(file.string() + ": " + problem), file_(file) {}

FileError::FileError(const std::filesystem::path& file, const FilePosition& position,
                     const std::string& problem)
    : Error(describe(file, position, problem)), file_(file), position_(position) {}

}  // namespace dyop
