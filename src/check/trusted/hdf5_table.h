// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <string>
#include <vector>

#include "check/trusted/json.h"
#include "check/trusted/vec.h"

/// Reading datasets of HDF5. TRUSTED.
namespace dyop_check {

class Hdf5Reader {
 public:
  /// @throws BadFile, as all that follows.
  explicit Hdf5Reader(const std::string& file);
  ~Hdf5Reader();
  Hdf5Reader(const Hdf5Reader&) = delete;
  Hdf5Reader& operator=(const Hdf5Reader&) = delete;

  std::string text_attribute(const char* name) const;
  std::int64_t integer_attribute(const char* name) const;
  bool has(const char* dataset) const;
  std::uint64_t length(const char* dataset) const;

  /// The first `count` rows of a column of a table, `width` numbers in each.
  std::vector<double> reals(const char* table, const char* column, std::uint64_t count,
                            std::size_t width = 1) const;
  std::vector<std::uint64_t> integers(const char* table, const char* column, std::uint64_t count,
                                      std::size_t width = 1) const;
  std::vector<Vec> vectors(const char* table, const char* column, std::uint64_t count) const;

  /// The same of a column of text.
  std::vector<std::string> names(const char* table, const char* column, std::uint64_t count) const;

  /// Rows as they are in the file, the last word filled up with zeros.
  std::vector<std::uint64_t> words(const std::string& dataset, std::uint64_t first,
                                   std::uint64_t count) const;

  /// `count` rows of a dataset of numbers from the row `first` on, `width` numbers in each.
  std::vector<double> numbers(const char* dataset, std::uint64_t count, std::size_t width = 1,
                              std::uint64_t first = 0) const;
  std::vector<std::int32_t> indices(const char* dataset, std::uint64_t count, std::size_t width,
                                    std::uint64_t first = 0) const;
  std::string bytes(const char* dataset, std::uint64_t count) const;
  /// The same as JSON, one value a line.
  std::vector<Json> json_lines(const char* dataset, std::uint64_t count) const;

 private:
  template <typename T>
  std::vector<T> column(const char* table, const char* name, hid_t type, std::uint64_t count,
                        std::size_t width) const;
  template <typename Numbers>
  Numbers rows(const char* dataset, hid_t type, std::uint64_t count, std::size_t width,
               std::uint64_t first) const;

  hid_t file_ = -1;
};

}  // namespace dyop_check
