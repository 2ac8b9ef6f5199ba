// SPDX-License-Identifier: BSD-3-Clause
#include "check/hdf5_table.h"

#include "check/json.h"

namespace dyop_check {
namespace {

constexpr unsigned kReadAttempts = 24;  // the library's default waits for hours on a damaged file
constexpr std::uint64_t kMostRows = std::uint64_t{1} << 34;

hid_t require(hid_t id, const std::string& what) {
  if (id < 0) throw BadFile(what + " cannot be read");
  return id;
}

}  // namespace

Hdf5Reader::Hdf5Reader(const std::string& file) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
  H5Pset_metadata_read_attempts(access, kReadAttempts);
  file_ = H5Fopen(file.c_str(), H5F_ACC_RDONLY | H5F_ACC_SWMR_READ, access);
  if (file_ < 0) file_ = H5Fopen(file.c_str(), H5F_ACC_RDONLY, access);
  H5Pclose(access);
  if (file_ < 0) throw BadFile("no readable HDF5 file");
}

Hdf5Reader::~Hdf5Reader() {
  H5Fclose(file_);
}

std::string Hdf5Reader::text_attribute(const char* name) const {
  const hid_t attribute = require(H5Aopen(file_, name, H5P_DEFAULT), name);
  const hid_t type = H5Aget_type(attribute);
  std::string text(H5Tget_size(type), '\0');
  const bool is_fixed = H5Tget_class(type) == H5T_STRING && H5Tis_variable_str(type) <= 0;
  const bool is_read = is_fixed && H5Aread(attribute, type, text.data()) >= 0;
  H5Tclose(type);
  H5Aclose(attribute);
  if (!is_read) throw BadFile(std::string("the attribute ") + name + " cannot be read");
  return text.substr(0, text.find('\0'));
}

std::int64_t Hdf5Reader::integer_attribute(const char* name) const {
  const hid_t attribute = require(H5Aopen(file_, name, H5P_DEFAULT), name);
  std::int64_t value = 0;
  const bool is_read = H5Aread(attribute, H5T_NATIVE_INT64, &value) >= 0;
  H5Aclose(attribute);
  if (!is_read) throw BadFile(std::string("the attribute ") + name + " cannot be read");
  return value;
}

std::uint64_t Hdf5Reader::length(const char* dataset) const {
  const hid_t id = require(H5Dopen2(file_, dataset, H5P_DEFAULT), dataset);
  const hid_t space = H5Dget_space(id);
  hsize_t size[2] = {0, 0};
  const int rank = H5Sget_simple_extent_ndims(space);
  if (rank == 1 || rank == 2) H5Sget_simple_extent_dims(space, size, nullptr);
  H5Sclose(space);
  H5Dclose(id);
  if (size[0] > kMostRows) throw BadFile(std::string(dataset) + " is too long");
  return size[0];
}

void Hdf5Reader::read(const char* dataset, hid_t type, std::uint64_t rows, void* out) const {
  if (rows == 0) return;
  if (rows > length(dataset)) throw BadFile(std::string(dataset) + " is too short");
  const hid_t id = require(H5Dopen2(file_, dataset, H5P_DEFAULT), dataset);
  const hid_t space = H5Dget_space(id);
  const int rank = H5Sget_simple_extent_ndims(space);
  hsize_t size[2] = {1, 1};
  H5Sget_simple_extent_dims(space, size, nullptr);
  size[0] = rows;
  const hsize_t start[2] = {0, 0};
  H5Sselect_hyperslab(space, H5S_SELECT_SET, start, nullptr, size, nullptr);
  const hid_t memory = H5Screate_simple(rank, size, nullptr);
  const bool is_read = H5Dread(id, type, memory, space, H5P_DEFAULT, out) >= 0;
  H5Sclose(memory);
  H5Sclose(space);
  H5Dclose(id);
  if (!is_read) throw BadFile(std::string(dataset) + " cannot be read");
}

template <typename T>
std::vector<T> Hdf5Reader::column(const char* table, const char* name, hid_t type,
                                  std::int64_t count) const {
  std::vector<T> values(count < 0 ? length(table) : std::uint64_t(count));
  const hid_t row = H5Tcreate(H5T_COMPOUND, sizeof(T));
  H5Tinsert(row, name, 0, type);
  try {
    read(table, row, values.size(), values.data());
  } catch (const BadFile&) {
    H5Tclose(row);
    throw;
  }
  H5Tclose(row);
  return values;
}

std::vector<double> Hdf5Reader::reals(const char* table, const char* name,
                                      std::int64_t count) const {
  return column<double>(table, name, H5T_NATIVE_DOUBLE, count);
}

std::vector<std::uint64_t> Hdf5Reader::integers(const char* table, const char* name,
                                                std::int64_t count) const {
  return column<std::uint64_t>(table, name, H5T_NATIVE_UINT64, count);
}

std::vector<std::array<double, 3>> Hdf5Reader::vectors(const char* table, const char* name,
                                                       std::int64_t count) const {
  const hsize_t three = 3;
  const hid_t type = H5Tarray_create2(H5T_NATIVE_DOUBLE, 1, &three);
  try {
    auto values = column<std::array<double, 3>>(table, name, type, count);
    H5Tclose(type);
    return values;
  } catch (const BadFile&) {
    H5Tclose(type);
    throw;
  }
}

std::vector<double> Hdf5Reader::numbers(const char* dataset, std::uint64_t rows) const {
  const bool is_vector = std::string(dataset) == "vertices";
  std::vector<double> values(rows * (is_vector ? 3 : 1));
  read(dataset, H5T_NATIVE_DOUBLE, rows, values.data());
  return values;
}

std::vector<std::int32_t> Hdf5Reader::indices(const char* dataset, std::uint64_t rows) const {
  std::vector<std::int32_t> values(3 * rows);
  read(dataset, H5T_NATIVE_INT32, rows, values.data());
  return values;
}

std::string Hdf5Reader::bytes(const char* dataset, std::uint64_t count) const {
  std::string text(count, '\0');
  read(dataset, H5T_NATIVE_UINT8, count, text.data());
  return text;
}

}  // namespace dyop_check
