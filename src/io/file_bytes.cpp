// SPDX-License-Identifier: BSD-3-Clause
#include "io/file_bytes.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <utility>

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

namespace {

namespace fs = std::filesystem;

// Names to try for the file beside; others may be left by killed processes.
constexpr int kMostNames = 100;

[[noreturn]] void fail(const fs::path& file, const char* problem, int number) {
  throw FileError(file, std::string(problem) + ": " + std::strerror(number));
}

// Owns a descriptor, and a file that is removed unless it took its place.
class PartFile {
 public:
  PartFile(int descriptor, fs::path path) : descriptor_(descriptor), path_(std::move(path)) {}
  ~PartFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (!path_.empty()) ::unlink(path_.c_str());
  }
  PartFile(const PartFile&) = delete;
  PartFile& operator=(const PartFile&) = delete;

  void write(std::string_view bytes, const fs::path& file) const {
    while (!bytes.empty()) {
      const ssize_t count = ::write(descriptor_, bytes.data(), bytes.size());
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) fail(file, "could not be written completely", count < 0 ? errno : ENOSPC);
      bytes.remove_prefix(std::size_t(count));
    }
  }
  void close(const fs::path& file) {
    const int descriptor = std::exchange(descriptor_, -1);
    if (::close(descriptor) != 0) fail(file, "could not be written completely", errno);
  }
  void take_place_of(const fs::path& file) {
    if (::fsync(descriptor_) != 0) fail(file, "could not be written completely", errno);
    struct stat old {};
    if (::stat(file.c_str(), &old) == 0) ::fchmod(descriptor_, old.st_mode & 07777);
    close(file);
    if (::rename(path_.c_str(), file.c_str()) != 0) fail(file, "could not be written", errno);
    path_.clear();
  }

 private:
  int descriptor_;
  fs::path path_;  // empty: nothing to remove
};

void write_directly(const fs::path& file, std::string_view bytes) {
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor < 0) fail(file, "could not be written", errno);
  PartFile out(descriptor, {});
  out.write(bytes, file);
  out.close(file);
}

fs::path behind_links(const fs::path& file) {
  std::error_code error;
  if (!fs::is_symlink(file, error)) return file;
  const fs::path target = fs::canonical(file, error);
  return error ? file : target;  // a link to nothing is replaced
}

}  // namespace

void write_whole_file(const fs::path& name, std::string_view bytes) {
  const fs::path file = behind_links(name);
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) return write_directly(file, bytes);
  for (int k = 0; k < kMostNames; ++k) {
    fs::path beside = file;
    beside += ".part-" + std::to_string(::getpid()) + "-" + std::to_string(k);
    const int descriptor = ::open(beside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor < 0 && errno == EEXIST) continue;
    // A folder in which only existing files may be written.
    if (descriptor < 0 && fs::exists(status)) return write_directly(file, bytes);
    if (descriptor < 0) fail(name, "could not be written", errno);
    PartFile out(descriptor, beside);
    out.write(bytes, name);
    out.take_place_of(file);
    return;
  }
  fail(name, "could not be written", EEXIST);
}

void require_other_than(const fs::path& out, std::initializer_list<fs::path> inputs) {
  if (out.empty()) return;
  for (const fs::path& input : inputs) {
    std::error_code error;
    if (!input.empty() && fs::equivalent(out, input, error)) {
      throw FileError(out, "is read by this command, so it cannot be written, too");
    }
  }
}

namespace {

constexpr std::uint64_t kOffsetBasis = 0xcbf29ce484222325u;
constexpr std::uint64_t kPrime = 0x100000001b3u;

}  // namespace

std::uint64_t digest_of(std::string_view bytes) {
  std::uint64_t hash = kOffsetBasis;
  for (const char byte : bytes) hash = (hash ^ static_cast<unsigned char>(byte)) * kPrime;
  return hash;
}

std::uint64_t digest_of(std::span<const std::uint64_t> words) {
  std::uint64_t hash = kOffsetBasis;
  for (const std::uint64_t word : words) hash = (hash ^ word) * kPrime;
  return hash;
}

std::string hex_digits(std::uint64_t value) {
  std::string digits(16, '0');
  for (std::size_t i = digits.size(); i-- > 0; value >>= 4)
    digits[i] = "0123456789abcdef"[value & 15u];
  return digits;
}

}  // namespace dyop::io_internal

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
