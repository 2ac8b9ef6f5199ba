// SPDX-License-Identifier: BSD-3-Clause
#include "check/trusted/hdf5_table.h"

#include <algorithm>
#include <array>
#include <sstream>

namespace dyop_check {
namespace {

constexpr unsigned kReadAttempts = 24;  // the library's default waits for hours on a damaged file
constexpr std::size_t kLargestBuffer = 1 << 20;  // bytes; the library's default

// An object of HDF5, closed in the end.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t), const std::string& what) : id_(id), close_(close) {
    if (id < 0) throw BadFile(what + " cannot be read");
  }
  ~Handle() { close_(id_); }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  operator hid_t() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

struct Dataset {
  Dataset(hid_t file, const std::string& path)
      : name(path),
        id(H5Dopen2(file, path.c_str(), H5P_DEFAULT), H5Dclose, path),
        space(H5Dget_space(id), H5Sclose, path),
        rank(H5Sget_simple_extent_ndims(space)) {
    if (rank != 1 && rank != 2) throw BadFile(name + " has an unknown form");
    H5Sget_simple_extent_dims(space, size.data(), nullptr);
  }

  // Compression by deflate is at most by 1032: more rows than that are not in the file.
  void require_rows(std::uint64_t count) const {
    constexpr std::uint64_t kLargestRatio = 1032;
    const Handle type(H5Dget_type(id), H5Tclose, name);
    const std::uint64_t row = H5Tget_size(type) * size[1];
    const std::uint64_t most = kLargestRatio * H5Dget_storage_size(id);
    if (count > size[0] || row == 0 || count > most / row) throw BadFile(name + " is too short");
  }

  // Rows, of which each has `width` elements of a type.
  void read(hid_t type, std::uint64_t first, std::uint64_t count, std::size_t width,
            void* out) const {
    if (size[1] != width) throw BadFile(name + " has an unknown form");
    const std::array<hsize_t, 2> start{first, 0};
    const std::array<hsize_t, 2> part{count, size[1]};
    H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, part.data(), nullptr);
    const Handle memory(H5Screate_simple(rank, part.data(), nullptr), H5Sclose, name);
    const Handle transfer(H5Pcreate(H5P_DATASET_XFER), H5Pclose, name);
    H5Pset_buffer(transfer, buffer_for(type, count * width), nullptr, nullptr);
    if (H5Dread(id, type, memory, space, transfer, out) < 0)
      throw BadFile(name + " cannot be read");
  }

  // The library clears all of its buffer each time, which takes longer than to read a short column.
  std::size_t buffer_for(hid_t type, std::uint64_t elements) const {
    const Handle stored(H5Dget_type(id), H5Tclose, name);
    const std::size_t largest = std::max(H5Tget_size(stored), H5Tget_size(type));
    const std::uint64_t most = std::max<std::uint64_t>(kLargestBuffer / largest, 1);
    return largest * std::size_t(std::clamp<std::uint64_t>(elements, 1, most));
  }

  std::string name;
  Handle id;
  Handle space;
  int rank;
  std::array<hsize_t, 2> size{1, 1};
};

}  // namespace

Hdf5Reader::Hdf5Reader(const std::string& file) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "HDF5");
  H5Pset_metadata_read_attempts(access, kReadAttempts);
  file_ = H5Fopen(file.c_str(), H5F_ACC_RDONLY | H5F_ACC_SWMR_READ, access);
  if (file_ < 0) file_ = H5Fopen(file.c_str(), H5F_ACC_RDONLY, access);
  if (file_ < 0) throw BadFile("no readable HDF5 file");
}

Hdf5Reader::~Hdf5Reader() {
  H5Fclose(file_);
}

std::string Hdf5Reader::text_attribute(const char* name) const {
  const Handle attribute(H5Aopen(file_, name, H5P_DEFAULT), H5Aclose, name);
  const Handle type(H5Aget_type(attribute), H5Tclose, name);
  std::string text(H5Tget_size(type), '\0');
  const Handle space(H5Aget_space(attribute), H5Sclose, name);
  const bool is_text = H5Tget_class(type) == H5T_STRING && H5Tis_variable_str(type) <= 0 &&
                       H5Sget_simple_extent_npoints(space) == 1;
  if (!is_text || H5Aread(attribute, type, text.data()) < 0)
    throw BadFile(std::string("the attribute ") + name + " cannot be read");
  return text.substr(0, text.find('\0'));
}

std::int64_t Hdf5Reader::integer_attribute(const char* name) const {
  const Handle attribute(H5Aopen(file_, name, H5P_DEFAULT), H5Aclose, name);
  const Handle space(H5Aget_space(attribute), H5Sclose, name);
  std::int64_t value = 0;
  if (H5Sget_simple_extent_npoints(space) != 1 || H5Aread(attribute, H5T_NATIVE_INT64, &value) < 0)
    throw BadFile(std::string("the attribute ") + name + " cannot be read");
  return value;
}

bool Hdf5Reader::has(const char* dataset) const {
  return H5Lexists(file_, dataset, H5P_DEFAULT) > 0;
}

std::uint64_t Hdf5Reader::length(const char* dataset) const {
  return Dataset(file_, dataset).size[0];
}

template <typename T>
std::vector<T> Hdf5Reader::column(const char* table, const char* name, hid_t type,
                                  std::uint64_t count, std::size_t width) const {
  if (count == 0 || width == 0) return {};
  const hsize_t size = width;
  const Handle list(H5Tarray_create2(type, 1, &size), H5Tclose, name);
  const Handle row(H5Tcreate(H5T_COMPOUND, width * sizeof(T)), H5Tclose, name);
  H5Tinsert(row, name, 0, width == 1 ? type : hid_t(list));
  const Dataset data(file_, table);
  data.require_rows(count);
  std::vector<T> numbers(count * width);
  data.read(row, 0, count, 1, numbers.data());
  return numbers;
}

std::vector<std::string> Hdf5Reader::names(const char* table, const char* name,
                                           std::uint64_t count) const {
  constexpr std::size_t kSize = 32;
  if (count == 0) return {};
  const Handle text(H5Tcopy(H5T_C_S1), H5Tclose, name);
  H5Tset_size(text, kSize);
  const Handle row(H5Tcreate(H5T_COMPOUND, kSize), H5Tclose, name);
  H5Tinsert(row, name, 0, text);
  const Dataset data(file_, table);
  data.require_rows(count);
  std::vector<std::array<char, kSize>> all(count);
  data.read(row, 0, count, 1, all.data());
  std::vector<std::string> names;
  for (const std::array<char, kSize>& one : all) {
    names.emplace_back(one.data(), std::find(one.begin(), one.end(), '\0') - one.begin());
  }
  return names;
}

std::vector<std::uint64_t> Hdf5Reader::words(const std::string& dataset, std::uint64_t first,
                                             std::uint64_t count) const {
  const Dataset data(file_, dataset);
  if (first + count < first) throw BadFile(dataset + " is too short");
  data.require_rows(first + count);
  const Handle type(H5Dget_type(data.id), H5Tclose, dataset);
  const std::uint64_t bytes = H5Tget_size(type) * data.size[1] * count;
  std::vector<std::uint64_t> words((bytes + 7) / 8);
  data.read(type, first, count, data.size[1], words.data());
  return words;
}

template <typename Numbers>
Numbers Hdf5Reader::rows(const char* dataset, hid_t type, std::uint64_t count, std::size_t width,
                         std::uint64_t first) const {
  if (count == 0) return {};
  const Dataset data(file_, dataset);
  if (first + count < first) throw BadFile(std::string(dataset) + " is too short");
  data.require_rows(first + count);
  Numbers numbers;
  numbers.resize(count * width);
  data.read(type, first, count, width, numbers.data());
  return numbers;
}

std::vector<double> Hdf5Reader::reals(const char* table, const char* name, std::uint64_t count,
                                      std::size_t width) const {
  return column<double>(table, name, H5T_NATIVE_DOUBLE, count, width);
}

std::vector<std::uint64_t> Hdf5Reader::integers(const char* table, const char* name,
                                                std::uint64_t count, std::size_t width) const {
  return column<std::uint64_t>(table, name, H5T_NATIVE_UINT64, count, width);
}

std::vector<Vec> Hdf5Reader::vectors(const char* table, const char* name,
                                     std::uint64_t count) const {
  std::vector<Vec> all;
  const std::vector<double> numbers = reals(table, name, count, 3);
  for (std::size_t k = 0; k < numbers.size(); k += 3)
    all.push_back({numbers[k], numbers[k + 1], numbers[k + 2]});
  return all;
}

std::vector<double> Hdf5Reader::numbers(const char* dataset, std::uint64_t count, std::size_t width,
                                        std::uint64_t first) const {
  return rows<std::vector<double>>(dataset, H5T_NATIVE_DOUBLE, count, width, first);
}

std::vector<std::int32_t> Hdf5Reader::indices(const char* dataset, std::uint64_t count,
                                              std::size_t width, std::uint64_t first) const {
  return rows<std::vector<std::int32_t>>(dataset, H5T_NATIVE_INT32, count, width, first);
}

std::string Hdf5Reader::bytes(const char* dataset, std::uint64_t count) const {
  return rows<std::string>(dataset, H5T_NATIVE_UINT8, count, 1, 0);
}

std::vector<Json> Hdf5Reader::json_lines(const char* dataset, std::uint64_t count) const {
  std::vector<Json> lines;
  std::istringstream in(bytes(dataset, count));
  for (std::string line; std::getline(in, line);) {
    if (!line.empty()) lines.push_back(parse_json(line));
  }
  return lines;
}

}  // namespace dyop_check
