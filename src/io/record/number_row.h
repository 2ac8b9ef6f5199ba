// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

#include "io/record/hdf5_file.h"

namespace dyop::io_internal {

template <typename Number>
hid_t number_type() {
  if constexpr (std::is_same_v<Number, double>) return H5T_NATIVE_DOUBLE;
  if constexpr (std::is_same_v<Number, float>) return H5T_NATIVE_FLOAT;
  if constexpr (std::is_same_v<Number, std::uint8_t>) return H5T_NATIVE_UINT8;
  if constexpr (std::is_same_v<Number, std::uint16_t>) return H5T_NATIVE_UINT16;
  if constexpr (std::is_same_v<Number, std::uint32_t>) return H5T_NATIVE_UINT32;
  if constexpr (std::is_same_v<Number, std::uint64_t>) return H5T_NATIVE_UINT64;
}

/// The numbers of a member, whether it is one or many.
template <typename Member>
auto numbers_of(Member& member) {
  if constexpr (std::is_arithmetic_v<std::remove_const_t<Member>>) {
    return std::span(&member, 1);
  } else {
    return std::span(member);
  }
}

/// A row of a table whose members are numbers or lists of numbers, known in length when it is made.
/// In the file without gaps between the members, and without the empty ones. `Row` has a static
/// for_each(row, visit), which calls visit(name of the column, span of the numbers).
template <typename Row>
class NumberRow {
 public:
  std::size_t bytes() const {
    std::size_t sum = 0;
    Row::for_each(row(), [&](const char*, auto numbers) { sum += numbers.size_bytes(); });
    return sum;
  }

  Hdf5RowType type() const {
    const QuietHdf5 quiet;
    Hdf5RowType type(bytes());
    std::size_t offset = 0;
    Row::for_each(row(), [&](const char* name, auto numbers) {
      using Number = std::remove_const_t<typename decltype(numbers)::element_type>;
      if (numbers.size() == 1) {
        type.add(name, offset, number_type<Number>());
      } else if (numbers.size() > 1) {
        type.add_array(name, offset, number_type<Number>(), numbers.size());
      }
      offset += numbers.size_bytes();
    });
    return type;
  }

  void append_to(std::vector<char>& out) const {
    Row::for_each(row(), [&](const char*, auto numbers) {
      const auto* bytes = reinterpret_cast<const char*>(numbers.data());
      out.insert(out.end(), bytes, bytes + numbers.size_bytes());
    });
  }

  void read_from(const char* bytes) {
    Row::for_each(static_cast<Row&>(*this), [&](const char*, auto numbers) {
      if (numbers.empty()) return;
      std::memcpy(numbers.data(), bytes, numbers.size_bytes());
      bytes += numbers.size_bytes();
    });
  }

 private:
  const Row& row() const { return static_cast<const Row&>(*this); }
};

}  // namespace dyop::io_internal
