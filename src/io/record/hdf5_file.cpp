// SPDX-License-Identifier: BSD-3-Clause
#include "io/record/hdf5_file.h"

#include <utility>

namespace dyop::io_internal {
namespace {

// Bytes of chunks that a dataset caches in memory, and slots in the table of chunks.
constexpr std::size_t kChunkCacheBytes = std::size_t{4} << 20;
constexpr std::size_t kChunkCacheSlots = 12'421;

// HDF5's innermost error message.
std::string innermost_message() {
  std::string message;
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned place, const H5E_error2_t* error, void* text) -> herr_t {
        if (place == 0 && error->desc != nullptr) *static_cast<std::string*>(text) = error->desc;
        return 0;
      },
      &message);
  return message;
}

std::vector<hsize_t> extent_of(std::uint64_t rows, hsize_t columns) {
  if (columns == 1) return {rows};
  return {rows, columns};
}

}  // namespace

QuietHdf5::QuietHdf5() {
  H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

QuietHdf5::~QuietHdf5() {
  H5Eset_auto2(H5E_DEFAULT, function_, data_);
}

Hdf5Handle& Hdf5Handle::operator=(Hdf5Handle&& other) noexcept {
  std::swap(id_, other.id_);
  std::swap(close_, other.close_);
  return *this;
}

void Hdf5Handle::reset() {
  if (id_ < 0) return;
  const QuietHdf5 quiet;
  close_(id_);
  id_ = -1;
}

Hdf5RowType::Hdf5RowType(std::size_t bytes) : type_(H5Tcreate(H5T_COMPOUND, bytes), &H5Tclose) {}

Hdf5RowType& Hdf5RowType::add(const char* name, std::size_t offset, hid_t type) {
  H5Tinsert(type_.get(), name, offset, type);
  return *this;
}

Hdf5RowType& Hdf5RowType::add_array(const char* name, std::size_t offset, hid_t type,
                                    hsize_t count) {
  const Hdf5Handle array(H5Tarray_create2(type, 1, &count), &H5Tclose);
  return add(name, offset, array.get());
}

Hdf5File::Hdf5File(std::filesystem::path path, hid_t file)
    : path_(std::move(path)), file_(file, &H5Fclose) {}

void Hdf5File::fail(const std::string& problem) const {
  const std::string message = innermost_message();
  throw FileError(path_, message.empty() ? problem : problem + ": " + message);
}

Hdf5File Hdf5File::create(const std::filesystem::path& file) {
  const QuietHdf5 quiet;
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), &H5Pclose);
  H5Pset_libver_bounds(access.get(), H5F_LIBVER_V110, H5F_LIBVER_V110);
  Hdf5File result(file, H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.get()));
  if (result.get() < 0) result.fail("could not be written");
  return result;
}

Hdf5File Hdf5File::open(const std::filesystem::path& file) {
  const QuietHdf5 quiet;
  if (!std::filesystem::exists(file)) throw FileError(file, "no such file");
  Hdf5File result(file, H5Fopen(file.c_str(), H5F_ACC_RDONLY | H5F_ACC_SWMR_READ, H5P_DEFAULT));
  if (result.get() < 0) {  // repacked into the format that older programs read
    result.file_ = Hdf5Handle(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), &H5Fclose);
  }
  if (result.get() < 0) result.fail("is not a readable HDF5 file");
  return result;
}

void Hdf5File::share_with_readers() {
  const QuietHdf5 quiet;
  if (H5Fstart_swmr_write(get()) < 0) fail("cannot be shared with readers");
}

void Hdf5File::write_attribute(const char* name, const std::string& text) {
  const QuietHdf5 quiet;
  const Hdf5Handle type(H5Tcopy(H5T_C_S1), &H5Tclose);
  H5Tset_size(type.get(), text.size() + 1);
  H5Tset_cset(type.get(), H5T_CSET_UTF8);
  const Hdf5Handle space(H5Screate(H5S_SCALAR), &H5Sclose);
  const Hdf5Handle attribute(
      H5Acreate2(get(), name, type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT), &H5Aclose);
  if (attribute.get() < 0 || H5Awrite(attribute.get(), type.get(), text.c_str()) < 0) {
    fail(std::string("attribute ") + name + " cannot be written");
  }
}

void Hdf5File::write_attribute(const char* name, std::int64_t value) {
  const QuietHdf5 quiet;
  const Hdf5Handle space(H5Screate(H5S_SCALAR), &H5Sclose);
  const Hdf5Handle attribute(
      H5Acreate2(get(), name, H5T_NATIVE_INT64, space.get(), H5P_DEFAULT, H5P_DEFAULT), &H5Aclose);
  if (attribute.get() < 0 || H5Awrite(attribute.get(), H5T_NATIVE_INT64, &value) < 0) {
    fail(std::string("attribute ") + name + " cannot be written");
  }
}

std::string Hdf5File::text_attribute(const char* name) const {
  const QuietHdf5 quiet;
  const Hdf5Handle attribute(H5Aopen(get(), name, H5P_DEFAULT), &H5Aclose);
  const Hdf5Handle type(H5Aget_type(attribute.get()), &H5Tclose);
  const bool is_text = attribute.get() >= 0 && H5Tget_class(type.get()) == H5T_STRING &&
                       H5Tis_variable_str(type.get()) == 0;
  if (!is_text) fail(std::string("is not a recording of dyop: no attribute ") + name);
  std::string text(H5Tget_size(type.get()), '\0');
  if (H5Aread(attribute.get(), type.get(), text.data()) < 0) {
    fail(std::string("attribute ") + name + " cannot be read");
  }
  text.resize(std::min(text.find('\0'), text.size()));
  return text;
}

std::int64_t Hdf5File::integer_attribute(const char* name) const {
  const QuietHdf5 quiet;
  const Hdf5Handle attribute(H5Aopen(get(), name, H5P_DEFAULT), &H5Aclose);
  std::int64_t value = 0;
  if (attribute.get() < 0 || H5Aread(attribute.get(), H5T_NATIVE_INT64, &value) < 0) {
    fail(std::string("is not a recording of dyop: no attribute ") + name);
  }
  return value;
}

void Hdf5File::close() {
  const QuietHdf5 quiet;
  const bool is_written = H5Fflush(get(), H5F_SCOPE_GLOBAL) >= 0;
  if (!is_written) fail("could not be written completely");
  file_.reset();
}

Hdf5Dataset::Hdf5Dataset(Hdf5File& file, const char* name, hid_t type, hsize_t columns,
                         hsize_t chunk_rows)
    : file_(&file), name_(name), type_(H5Tcopy(type), &H5Tclose), columns_(columns) {
  const QuietHdf5 quiet;
  const std::vector<hsize_t> none = extent_of(0, columns);
  const std::vector<hsize_t> most = extent_of(H5S_UNLIMITED, columns);
  const std::vector<hsize_t> chunk = extent_of(chunk_rows, columns);
  const int rank = static_cast<int>(none.size());
  const Hdf5Handle space(H5Screate_simple(rank, none.data(), most.data()), &H5Sclose);
  const Hdf5Handle options(H5Pcreate(H5P_DATASET_CREATE), &H5Pclose);
  H5Pset_chunk(options.get(), rank, chunk.data());
  dataset_ = Hdf5Handle(
      H5Dcreate2(file.get(), name, type, space.get(), H5P_DEFAULT, options.get(), H5P_DEFAULT),
      &H5Dclose);
  check(dataset_.get() >= 0, "could not be created");
}

Hdf5Dataset Hdf5Dataset::open(Hdf5File& file, const char* name, hid_t type, hsize_t columns) {
  const QuietHdf5 quiet;
  Hdf5Dataset result;
  result.file_ = &file;
  result.name_ = name;
  result.type_ = Hdf5Handle(H5Tcopy(type), &H5Tclose);
  result.columns_ = columns;
  const Hdf5Handle access(H5Pcreate(H5P_DATASET_ACCESS), &H5Pclose);
  H5Pset_chunk_cache(access.get(), kChunkCacheSlots, kChunkCacheBytes, H5D_CHUNK_CACHE_W0_DEFAULT);
  result.dataset_ = Hdf5Handle(H5Dopen2(file.get(), name, access.get()), &H5Dclose);
  result.check(result.dataset_.get() >= 0, "is missing");
  result.find_length();
  return result;
}

void Hdf5Dataset::check(bool is_good, const char* what) const {
  if (!is_good) file_->fail("dataset " + name_ + " " + what);
}

Hdf5Handle Hdf5Dataset::select(std::uint64_t first, std::uint64_t count) const {
  Hdf5Handle space(H5Dget_space(dataset_.get()), &H5Sclose);
  const std::vector<hsize_t> start =
      columns_ == 1 ? std::vector<hsize_t>{first} : std::vector<hsize_t>{first, 0};
  const std::vector<hsize_t> extent = extent_of(count, columns_);
  check(H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, start.data(), nullptr, extent.data(),
                            nullptr) >= 0,
        "is shorter than it should be");
  return space;
}

Hdf5Handle Hdf5Dataset::rows_in_memory(std::uint64_t count) const {
  const std::vector<hsize_t> extent = extent_of(count, columns_);
  return {H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr), &H5Sclose};
}

void Hdf5Dataset::append(const void* rows, std::size_t count) {
  if (count == 0) return;
  const QuietHdf5 quiet;
  const std::vector<hsize_t> extent = extent_of(length_ + count, columns_);
  check(H5Dset_extent(dataset_.get(), extent.data()) >= 0, "cannot grow");
  const Hdf5Handle file_rows = select(length_, count);
  const Hdf5Handle memory_rows = rows_in_memory(count);
  check(H5Dwrite(dataset_.get(), type_.get(), memory_rows.get(), file_rows.get(), H5P_DEFAULT,
                 rows) >= 0,
        "could not be written");
  length_ += count;
}

void Hdf5Dataset::flush() {
  const QuietHdf5 quiet;
  check(H5Dflush(dataset_.get()) >= 0, "could not be written");
}

// H5Drefresh() would report rows that another process has written since. It is not used: if a
// process has opened the same dataset twice, HDF5 1.10.8 then reads wrong numbers.
void Hdf5Dataset::find_length() {
  const Hdf5Handle space(H5Dget_space(dataset_.get()), &H5Sclose);
  const int rank = H5Sget_simple_extent_ndims(space.get());
  check(rank == (columns_ == 1 ? 1 : 2), "has a different number of dimensions");
  std::array<hsize_t, 2> extent{0, 1};
  H5Sget_simple_extent_dims(space.get(), extent.data(), nullptr);
  check(columns_ == 1 || extent[1] == columns_, "has a different number of columns");
  length_ = extent[0];
}

void Hdf5Dataset::require(std::uint64_t first, std::uint64_t count) const {
  check(first <= length_ && count <= length_ - first, "is shorter than it should be");
}

void Hdf5Dataset::read(std::uint64_t first, std::uint64_t count, void* rows) const {
  if (count == 0) return;
  const QuietHdf5 quiet;
  require(first, count);
  const Hdf5Handle file_rows = select(first, count);
  const Hdf5Handle memory_rows = rows_in_memory(count);
  check(H5Dread(dataset_.get(), type_.get(), memory_rows.get(), file_rows.get(), H5P_DEFAULT,
                rows) >= 0,
        "could not be read");
}

}  // namespace dyop::io_internal
