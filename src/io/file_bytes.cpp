// SPDX-License-Identifier: BSD-3-Clause
#include "io/file_bytes.h"

#include <zlib.h>

#include <array>
#include <fstream>
#include <memory>
#include <sstream>

#include "dyop/io/file_error.h"

namespace dyop::io_internal {
namespace {

void require_file(const std::filesystem::path& file) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status)) throw MissingFile(file);
  if (std::filesystem::is_directory(status)) {
    throw FileError(file, "expected a file, found a directory");
  }
}

}  // namespace

std::string read_bytes(const std::filesystem::path& file) {
  require_file(file);
  std::ifstream in(file, std::ios::binary);
  std::ostringstream bytes;
  if (in && in.peek() != std::ifstream::traits_type::eof()) bytes << in.rdbuf();
  if (!in && !in.eof()) throw FileError(file, "could not be read");
  return std::move(bytes).str();
}

std::string read_gzip_bytes(const std::filesystem::path& file, std::size_t most_bytes) {
  require_file(file);
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> in(gzopen(file.c_str(), "rb"), &gzclose_r);
  if (!in) throw FileError(file, "could not be read");
  std::string bytes;
  std::array<char, 1 << 16> block;
  int count = 0;
  while ((count = gzread(in.get(), block.data(), unsigned(block.size()))) > 0) {
    if (std::size_t(count) > most_bytes - bytes.size()) {
      throw FileError(file, "unpacks to more than " + std::to_string(most_bytes) +
                                " bytes; unpack it yourself, or raise the limit");
    }
    bytes.append(block.data(), std::size_t(count));
  }
  int code = Z_OK;
  const char* reason = gzerror(in.get(), &code);
  // A file that ends within the compressed data is reported only through the code.
  if (count < 0 || (code != Z_OK && code != Z_STREAM_END)) {
    throw FileError(file, std::string("damaged gzip data: ") + reason);
  }
  return bytes;
}

}  // namespace dyop::io_internal
