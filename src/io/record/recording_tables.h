// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <vector>

#include "io/record/recording_rows.h"

/// The datasets of a recording as rows of one type.
namespace dyop::io_internal {

/// A dataset that is written; rows wait for the end of the frame.
template <typename Row>
class OutputRows {
 public:
  OutputRows(Hdf5File& file, const char* name, hid_t type, hsize_t columns, hsize_t chunk_rows)
      : dataset_(file, name, type, columns, chunk_rows) {}

  void add(const Row& row) { waiting_.push_back(row); }
  template <typename Range>
  void add_all(const Range& rows) {
    waiting_.insert(waiting_.end(), std::begin(rows), std::end(rows));
  }
  /// Including the rows that wait.
  std::uint64_t length() const { return dataset_.length() + waiting_.size(); }
  void flush() {
    if (waiting_.empty()) return;
    dataset_.append(waiting_.data(), waiting_.size());
    dataset_.flush();
    waiting_.clear();
  }

 private:
  Hdf5Dataset dataset_;
  std::vector<Row> waiting_;
};

/// A dataset that is read.
template <typename Row>
class InputRows {
 public:
  InputRows(Hdf5File& file, const char* name, hid_t type, hsize_t columns)
      : dataset_(Hdf5Dataset::open(file, name, type, columns)) {}

  std::uint64_t length() const { return dataset_.length(); }
  std::vector<Row> read(std::uint64_t first, std::uint64_t count) const {
    dataset_.require(first, count);
    std::vector<Row> rows(count);
    dataset_.read(first, count, rows.data());
    return rows;
  }

 private:
  Hdf5Dataset dataset_;
};

/// A long dataset that is read at random: caches the blocks that were read last.
template <typename Row>
class BlockCache {
 public:
  /// @param known Number of final rows: only whole blocks of them are cached.
  std::vector<Row> read(const InputRows<Row>& rows, std::uint64_t first, std::uint64_t count,
                        std::uint64_t known) {
    std::vector<Row> result;
    result.reserve(count);
    for (std::uint64_t next = first; next < first + count;) {
      const std::uint64_t start = next / kBlockRows * kBlockRows;
      if (start + kBlockRows > known) {
        const std::vector<Row> rest = rows.read(next, first + count - next);
        result.insert(result.end(), rest.begin(), rest.end());
        return result;
      }
      const std::vector<Row>& block = block_at(rows, start);
      const std::uint64_t end = std::min(first + count, start + kBlockRows);
      result.insert(result.end(), block.begin() + std::ptrdiff_t(next - start),
                    block.begin() + std::ptrdiff_t(end - start));
      next = end;
    }
    return result;
  }

 private:
  static constexpr std::uint64_t kBlockRows = 1 << 15;
  static constexpr std::size_t kMostBlocks = 1 << 10;  // 256 MB of doubles

  const std::vector<Row>& block_at(const InputRows<Row>& rows, std::uint64_t start) {
    const std::size_t number = start / kBlockRows;
    if (number >= blocks_.size()) blocks_.resize(number + 1);
    if (blocks_[number].empty()) {
      if (loaded_.size() >= kMostBlocks) {
        std::vector<Row>().swap(blocks_[loaded_[oldest_]]);
        loaded_[oldest_] = number;
        oldest_ = (oldest_ + 1) % kMostBlocks;
      } else {
        loaded_.push_back(number);
      }
      blocks_[number] = rows.read(start, kBlockRows);
    }
    return blocks_[number];
  }

  std::vector<std::vector<Row>> blocks_;  // by number; empty: not loaded
  std::vector<std::size_t> loaded_;       // numbers, a ring once it is full
  std::size_t oldest_ = 0;
};

}  // namespace dyop::io_internal
