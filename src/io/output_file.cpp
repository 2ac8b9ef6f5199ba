// SPDX-License-Identifier: BSD-3-Clause
#include "io/output_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "dyop/io/file_error.h"

namespace dyop::io_internal {
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

}  // namespace dyop::io_internal
