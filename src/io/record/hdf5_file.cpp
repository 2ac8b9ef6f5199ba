// SPDX-License-Identifier: BSD-3-Clause
#include "io/record/hdf5_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

#include "io/file_bytes.h"

namespace dyop::io_internal {
namespace {

// Bytes of chunks that a dataset caches in memory, and slots in the table of chunks.
constexpr std::size_t kChunkCacheBytes = std::size_t{4} << 20;
constexpr std::size_t kChunkCacheSlots = 12'421;

// Times that metadata whose checksum is wrong is read again, as a writer may be at it; HDF5 waits
// twice as long each time, from a nanosecond on: some 30 ms in all. Its default of 100 never ends.
constexpr unsigned kMetadataReadAttempts = 24;

// Other openings of the file keep their own locks, which closing this one must not release.
bool lock_for_writing(int descriptor) {
  struct flock whole {};
  whole.l_type = F_WRLCK;
  whole.l_whence = SEEK_SET;
  return ::fcntl(descriptor, F_OFD_SETLK, &whole) == 0;
}

// True for what a recording may replace.
bool is_recording_or_empty(const std::filesystem::path& file) {
  std::error_code error;
  return std::filesystem::file_size(file, error) == 0 || H5Fis_hdf5(file.c_str()) > 0;
}

// Bytes of rows that share a digest, and rows of a chunk of digests.
constexpr std::uint64_t kDigestBytes = 1 << 16;
constexpr hsize_t kDigestRows = 64;

// Columns of a dataset of one or two dimensions.
hsize_t columns_of(hid_t dataset) {
  const Hdf5Handle space(H5Dget_space(dataset), &H5Sclose);
  std::array<hsize_t, 2> extent{0, 1};
  const int rank = H5Sget_simple_extent_ndims(space.get());
  if (rank == 2) H5Sget_simple_extent_dims(space.get(), extent.data(), nullptr);
  return extent[1];
}

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

FileLock::FileLock(const std::filesystem::path& file)
    : descriptor_(::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666)) {
  if (descriptor_ < 0) {
    throw FileError(file, std::string("could not be written: ") + std::strerror(errno));
  }
  if (!lock_for_writing(descriptor_)) {
    ::close(std::exchange(descriptor_, -1));
    throw FileError(file, "is being recorded to by another run");
  }
}

FileLock::~FileLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

FileLock& FileLock::operator=(FileLock&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

PartName::PartName(const std::filesystem::path& file) {
  std::error_code error;
  file_ = std::filesystem::is_symlink(file, error) ? std::filesystem::canonical(file, error) : file;
  if (error || !std::filesystem::is_regular_file(file_, error)) return;
  constexpr int kMostNames = 100;  // others may be left by killed processes
  for (int k = 0; k < kMostNames; ++k) {
    std::filesystem::path part = file_;
    part += ".part-" + std::to_string(::getpid()) + "-" + std::to_string(k);
    const int descriptor = ::open(part.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor < 0 && errno == EEXIST) continue;
    if (descriptor < 0) return;  // a folder in which only existing files may be written
    struct stat old {};
    if (::stat(file_.c_str(), &old) == 0) ::fchmod(descriptor, old.st_mode & 07777);
    ::close(descriptor);
    path_ = std::move(part);
    return;
  }
}

PartName::~PartName() {
  if (!path_.empty()) ::unlink(path_.c_str());
}

PartName& PartName::operator=(PartName&& other) noexcept {
  std::swap(file_, other.file_);
  std::swap(path_, other.path_);
  return *this;
}

bool PartName::take_place() {
  if (::rename(path_.c_str(), file_.c_str()) != 0) return false;
  path_.clear();
  return true;
}

Hdf5File::Hdf5File(std::filesystem::path path, hid_t file)
    : path_(std::move(path)), file_(file, &H5Fclose) {}

void Hdf5File::fail(const std::string& problem) const {
  const std::string message = innermost_message();
  throw FileError(path_, message.empty() ? problem : problem + ": " + message);
}

Hdf5File Hdf5File::create(const std::filesystem::path& file) {
  const QuietHdf5 quiet;
  FileLock lock(file);
  if (!is_recording_or_empty(file)) {
    throw FileError(file, "exists and is not a recording, so it is not replaced");
  }
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), &H5Pclose);
  H5Pset_libver_bounds(access.get(), H5F_LIBVER_V110, H5F_LIBVER_V110);
  Hdf5File result(file, -1);
  result.lock_ = std::move(lock);
  result.part_ = PartName(file);
  const std::filesystem::path& place = result.part_.path().empty() ? file : result.part_.path();
  result.file_ =
      Hdf5Handle(H5Fcreate(place.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.get()), &H5Fclose);
  if (result.get() < 0) result.fail("could not be written");
  return result;
}

// The file has its name from here on, and keeps other writers away under it.
void Hdf5File::publish() {
  if (part_.path().empty()) return;
  part_lock_ = FileLock(part_.path());
  if (!part_.take_place()) fail("could not be written");
}

Hdf5File Hdf5File::open(const std::filesystem::path& file) {
  const QuietHdf5 quiet;
  if (!std::filesystem::exists(file)) throw MissingFile(file);
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), &H5Pclose);
  H5Pset_metadata_read_attempts(access.get(), kMetadataReadAttempts);
  Hdf5File result(file, H5Fopen(file.c_str(), H5F_ACC_RDONLY | H5F_ACC_SWMR_READ, access.get()));
  if (result.get() < 0) {  // repacked into the format that older programs read
    result.file_ = Hdf5Handle(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), &H5Fclose);
  }
  if (result.get() < 0) result.fail("is not a readable HDF5 file");
  result.read_digests();
  return result;
}

namespace {

constexpr const char* kDigests = "digests";

std::string_view name_of(const BlockDigest& digest) {
  return {digest.dataset.data(), ::strnlen(digest.dataset.data(), digest.dataset.size())};
}

Hdf5RowType digest_row() {
  Hdf5RowType row(sizeof(BlockDigest));
  const Hdf5Handle name(H5Tcopy(H5T_C_S1), &H5Tclose);
  H5Tset_size(name.get(), sizeof(BlockDigest::dataset));
  row.add("dataset", offsetof(BlockDigest, dataset), name.get())
      .add("first", offsetof(BlockDigest, first), H5T_NATIVE_UINT64)
      .add("count", offsetof(BlockDigest, count), H5T_NATIVE_UINT64)
      .add("digest", offsetof(BlockDigest, digest), H5T_NATIVE_UINT64);
  return row;
}

}  // namespace

// Not HDF5's own checksums: those of a chunk that is still filled are wrong for a moment whenever
// rows are added, which breaks what readers of a running or killed run are promised.
void Hdf5File::write_digests() {
  std::vector<BlockDigest> all;
  for (const std::string& name : written_) {
    const Hdf5Handle dataset(H5Dopen2(get(), name.c_str(), H5P_DEFAULT), &H5Dclose);
    const Hdf5Handle type(H5Dget_type(dataset.get()), &H5Tclose);
    for (BlockDigest& digest :
         Hdf5Dataset::open(*this, name.c_str(), type.get(), columns_of(dataset.get()))
             .digests_of_all()) {
      name.copy(digest.dataset.data(), digest.dataset.size() - 1);
      all.push_back(digest);
    }
  }
  if (H5Lexists(get(), kDigests, H5P_DEFAULT) <= 0) return;  // never shared with readers
  Hdf5Dataset rows = Hdf5Dataset::open(*this, kDigests, digest_row().get(), 1);
  rows.append(all.data(), all.size());
  rows.flush();
}

void Hdf5File::read_digests() {
  if (H5Lexists(get(), kDigests, H5P_DEFAULT) <= 0) return;
  const Hdf5Dataset rows = Hdf5Dataset::open(*this, kDigests, digest_row().get(), 1);
  std::vector<BlockDigest> digests(rows.length());
  rows.read(0, rows.length(), digests.data());
  digests_ = std::move(digests);
}

void Hdf5File::share_with_readers() {
  const QuietHdf5 quiet;
  const std::vector<std::string> recorded = written_;
  { const Hdf5Dataset digests(*this, kDigests, digest_row().get(), 1, kDigestRows); }
  written_ = recorded;
  if (H5Fstart_swmr_write(get()) < 0) fail("cannot be shared with readers");
  publish();
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
  write_digests();
  const bool is_written = H5Fflush(get(), H5F_SCOPE_GLOBAL) >= 0;
  if (!is_written) fail("could not be written completely");
  publish();
  file_.reset();
  part_lock_ = FileLock();
  lock_ = FileLock();
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
  file.written_.emplace_back(name);
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
  result.find_digests();
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

// The bytes as they are in the file, eight at a time.
std::uint64_t Hdf5Dataset::digest_of_rows(std::uint64_t first, std::uint64_t count) const {
  const Hdf5Handle type(H5Dget_type(dataset_.get()), &H5Tclose);
  const std::size_t size = H5Tget_size(type.get()) * columns_ * count;
  std::vector<std::uint64_t> words((size + sizeof(std::uint64_t) - 1) / sizeof(std::uint64_t));
  const Hdf5Handle file_rows = select(first, count);
  const Hdf5Handle memory_rows = rows_in_memory(count);
  check(H5Dread(dataset_.get(), type.get(), memory_rows.get(), file_rows.get(), H5P_DEFAULT,
                words.data()) >= 0,
        "could not be read");
  return digest_of(words);
}

std::vector<BlockDigest> Hdf5Dataset::digests_of_all() const {
  const Hdf5Handle type(H5Dget_type(dataset_.get()), &H5Tclose);
  const std::uint64_t row_bytes = std::max<std::uint64_t>(H5Tget_size(type.get()) * columns_, 1);
  const std::uint64_t block = std::max<std::uint64_t>(kDigestBytes / row_bytes, 1);
  std::vector<BlockDigest> digests;
  for (std::uint64_t first = 0; first < length_; first += block) {
    BlockDigest& digest = digests.emplace_back();
    digest.first = first;
    digest.count = std::min(block, length_ - first);
    digest.digest = digest_of_rows(digest.first, digest.count);
  }
  return digests;
}

// Takes those of this dataset from the file's, if it has any.
void Hdf5Dataset::find_digests() {
  if (file_->digests_.empty()) return;
  for (const BlockDigest& digest : file_->digests_) {
    if (name_of(digest) == name_) digests_.push_back(digest);
  }
  std::uint64_t next = 0;
  for (const BlockDigest& digest : digests_) {
    const bool is_in_place = digest.first == next && digest.count > 0 &&
                             digest.count <= digests_.front().count &&
                             digest.count <= length_ - next;
    check(is_in_place, "is damaged: its digests do not fit");
    next += digest.count;
  }
  check(next == length_, "is damaged: its digests do not fit");
  is_checked_.assign(digests_.size(), false);
}

// Each block is checked when one of its rows is read for the first time. `rows` are those read; a
// block of which all are there, as they are in the file, is not read once more.
void Hdf5Dataset::check_digests(std::uint64_t first, std::uint64_t count, const void* rows) const {
  if (digests_.empty()) return;
  const Hdf5Handle type(H5Dget_type(dataset_.get()), &H5Tclose);
  const std::size_t row_bytes = H5Tget_size(type.get()) * columns_;
  const bool is_as_in_file =
      H5Tequal(type.get(), type_.get()) > 0 && row_bytes % sizeof(std::uint64_t) == 0;
  const std::uint64_t block_rows = digests_.front().count;
  for (std::uint64_t k = first / block_rows; k <= (first + count - 1) / block_rows; ++k) {
    if (is_checked_[k]) continue;
    const BlockDigest& block = digests_[k];
    const bool is_read = first <= block.first && block.first + block.count <= first + count;
    std::uint64_t digest = 0;
    if (is_read && is_as_in_file) {
      const auto* words = static_cast<const std::uint64_t*>(rows);
      const std::size_t row_words = row_bytes / sizeof(std::uint64_t);
      digest =
          digest_of(std::span(words + (block.first - first) * row_words, block.count * row_words));
    } else {
      digest = digest_of_rows(block.first, block.count);
    }
    check(digest == block.digest, "is damaged");
    is_checked_[k] = true;
  }
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
  check_digests(first, count, rows);
}

}  // namespace dyop::io_internal
