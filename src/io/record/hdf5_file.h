// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <hdf5.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
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

class Hdf5File {
 public:
  /// Replaces the file.
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
  std::filesystem::path path_;
  Hdf5Handle file_;
};

/// A dataset that grows: rows of one type, or of `columns` numbers.
class Hdf5Dataset {
 public:
  Hdf5Dataset(Hdf5File& file, const char* name, hid_t type, hsize_t columns, hsize_t chunk_rows);
  static Hdf5Dataset open(Hdf5File& file, const char* name, hid_t type, hsize_t columns);

  void append(const void* rows, std::size_t count);
  void flush();
  std::uint64_t length() const { return length_; }
  /// Throws unless these rows exist.
  void require(std::uint64_t first, std::uint64_t count) const;
  void read(std::uint64_t first, std::uint64_t count, void* rows) const;

 private:
  Hdf5Dataset() = default;
  void find_length();
  void check(bool is_good, const char* what) const;
  Hdf5Handle select(std::uint64_t first, std::uint64_t count) const;
  Hdf5Handle rows_in_memory(std::uint64_t count) const;

  Hdf5File* file_ = nullptr;
  std::string name_;
  Hdf5Handle dataset_;
  Hdf5Handle type_;
  hsize_t columns_ = 1;
  std::uint64_t length_ = 0;
};

}  // namespace dyop::io_internal
