// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <hdf5.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

/// Reading datasets of HDF5. TRUSTED.
namespace dyop_check {

class Hdf5Reader {
 public:
  /// @throws BadFile
  explicit Hdf5Reader(const std::string& file);
  ~Hdf5Reader();
  Hdf5Reader(const Hdf5Reader&) = delete;
  Hdf5Reader& operator=(const Hdf5Reader&) = delete;

  std::string text_attribute(const char* name) const;
  std::int64_t integer_attribute(const char* name) const;
  /// The first `count` numbers of a column of a table; all if it is negative.
  std::vector<double> reals(const char* table, const char* column, std::int64_t count = -1) const;
  std::vector<std::uint64_t> integers(const char* table, const char* column,
                                      std::int64_t count = -1) const;
  /// A column of three numbers a row.
  std::vector<std::array<double, 3>> vectors(const char* table, const char* column,
                                             std::int64_t count) const;
  /// The first `rows` rows of a dataset of numbers.
  std::vector<double> numbers(const char* dataset, std::uint64_t rows) const;
  std::vector<std::int32_t> indices(const char* dataset, std::uint64_t rows) const;
  std::string bytes(const char* dataset, std::uint64_t count) const;
  std::uint64_t length(const char* dataset) const;

 private:
  void read(const char* dataset, hid_t type, std::uint64_t rows, void* out) const;
  template <typename T>
  std::vector<T> column(const char* table, const char* name, hid_t type, std::int64_t count) const;

  hid_t file_ = -1;
};

}  // namespace dyop_check
