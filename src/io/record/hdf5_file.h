// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <hdf5.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "dyop/io/file_error.h"

/// The parts of HDF5 that a recording needs. No call prints; failures throw a FileError that names
/// the file.
namespace dyop::io_internal {

/// While it lives, HDF5 prints no errors in this thread.
class QuietHdf5 {
 public:
  QuietHdf5();
  ~QuietHdf5();
  QuietHdf5(const QuietHdf5&) = delete;
  QuietHdf5& operator=(const QuietHdf5&) = delete;

 private:
  H5E_auto2_t function_ = nullptr;
  void* data_ = nullptr;
};

/// Owns one identifier of HDF5.
class Hdf5Handle {
 public:
  using Close = herr_t (*)(hid_t);

  Hdf5Handle() = default;
  Hdf5Handle(hid_t id, Close close) : id_(id), close_(close) {}
  ~Hdf5Handle() { reset(); }
  Hdf5Handle(Hdf5Handle&& other) noexcept : id_(other.id_), close_(other.close_) { other.id_ = -1; }
  Hdf5Handle& operator=(Hdf5Handle&& other) noexcept;

  hid_t get() const { return id_; }
  void reset();

 private:
  hid_t id_ = -1;
  Close close_ = nullptr;
};

/// The type of a table's row, member by member.
class Hdf5RowType {
 public:
  explicit Hdf5RowType(std::size_t bytes);
  Hdf5RowType& add(const char* name, std::size_t offset, hid_t type);
  Hdf5RowType& add_array(const char* name, std::size_t offset, hid_t type, hsize_t count);
  hid_t get() const { return type_.get(); }

 private:
  Hdf5Handle type_;
};

/// Keeps other writers, here and in other processes, away from a file. Readers are not kept away.
class FileLock {
 public:
  FileLock() = default;
  /// Creates the file if it is missing.
  /// @throws FileError if it cannot be written, or has a writer.
  explicit FileLock(const std::filesystem::path& file);
  ~FileLock();
  FileLock(FileLock&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  FileLock& operator=(FileLock&& other) noexcept;

 private:
  int descriptor_ = -1;
};

/// A new file beside another one, whose place it takes once readers may see it: HDF5 locks a file
/// that is opened, so a reader in the moment of its creation would make its writer fail.
class PartName {
 public:
  PartName() = default;
  /// Has no path if no file can be made beside this one, or if it is none.
  explicit PartName(const std::filesystem::path& file);
  ~PartName();
  PartName(PartName&& other) noexcept { *this = std::move(other); }
  PartName& operator=(PartName&& other) noexcept;

  const std::filesystem::path& path() const { return path_; }
  bool take_place();

 private:
  std::filesystem::path file_;  // behind links
  std::filesystem::path path_;  // empty: nothing to remove
};

/// The digest of some rows of a dataset. close() writes those of all rows; a file whose writer was
/// killed, or still writes, has none.
struct BlockDigest {
  std::array<char, 32> dataset{};
  std::uint64_t first = 0;  ///< row
  std::uint64_t count = 0;
  std::uint64_t digest = 0;
};

class Hdf5File {
 public:
  /// Replaces a file that is a recording, or empty; any other file is refused, and so is one that
  /// another process or writer is recording to.
  static Hdf5File create(const std::filesystem::path& file);
  /// For reading, even while another process writes it.
  static Hdf5File open(const std::filesystem::path& file);

  /// From now on others may read flushed data; no further datasets can be added.
  void share_with_readers();
  void write_attribute(const char* name, const std::string& text);
  void write_attribute(const char* name, std::int64_t value);
  std::string text_attribute(const char* name) const;
  std::int64_t integer_attribute(const char* name) const;
  void close();

  hid_t get() const { return file_.get(); }
  const std::filesystem::path& path() const { return path_; }
  [[noreturn]] void fail(const std::string& problem) const;

 private:
  Hdf5File(std::filesystem::path path, hid_t file);
  friend class Hdf5Dataset;
  void publish();
  void write_digests();
  void read_digests();

  std::filesystem::path path_;
  FileLock lock_;  // of the file that it replaces
  FileLock part_lock_;
  PartName part_;
  Hdf5Handle file_;
  std::vector<std::string> written_;  // names of datasets
  std::vector<BlockDigest> digests_;  // of a file that is read, by dataset and row
};

/// A dataset that grows: rows of one type, or of `columns` numbers.
class Hdf5Dataset {
 public:
  Hdf5Dataset(Hdf5File& file, const char* name, hid_t type, hsize_t columns, hsize_t chunk_rows);
  static Hdf5Dataset open(Hdf5File& file, const char* name, hid_t type, hsize_t columns);

  void append(const void* rows, std::size_t count);
  void flush();
  /// Digests of all rows, in blocks of one size; the last may be shorter.
  std::vector<BlockDigest> digests_of_all() const;
  std::uint64_t length() const { return length_; }
  /// Throws unless these rows exist.
  void require(std::uint64_t first, std::uint64_t count) const;
  void read(std::uint64_t first, std::uint64_t count, void* rows) const;

 private:
  Hdf5Dataset() = default;
  void find_length();
  void check(bool is_good, const char* what) const;
  Hdf5Handle select(std::uint64_t first, std::uint64_t count) const;
  std::uint64_t digest_of_rows(std::uint64_t first, std::uint64_t count) const;
  void find_digests();
  void check_digests(std::uint64_t first, std::uint64_t count, const void* rows) const;
  Hdf5Handle rows_in_memory(std::uint64_t count) const;

  Hdf5File* file_ = nullptr;
  std::string name_;
  Hdf5Handle dataset_;
  Hdf5Handle type_;
  hsize_t columns_ = 1;
  std::uint64_t length_ = 0;
  std::vector<BlockDigest> digests_;      // of a file that its writer closed, by row
  mutable std::vector<bool> is_checked_;  // by block
};

}  // namespace dyop::io_internal
