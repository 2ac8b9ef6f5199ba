// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

namespace dyop::toi_internal {

/// An array that grows by whole blocks: elements never move, so that growing costs the same however
/// many there are. Memory is kept until the end.
template <typename Element>
class GrowingBlocks {
 public:
  std::size_t size() const { return size_; }
  /// New elements have no value yet.
  void resize(std::size_t size) {
    reserve(size);
    size_ = size;
  }
  void reserve(std::size_t size) {
    while (blocks_.size() * kBlock < size) {
      blocks_.push_back(std::make_unique_for_overwrite<Element[]>(kBlock));
    }
  }

  Element& operator[](std::size_t number) { return blocks_[number / kBlock][number % kBlock]; }
  const Element& operator[](std::size_t number) const {
    return blocks_[number / kBlock][number % kBlock];
  }

 private:
  static constexpr std::size_t kBlock = 1024;

  std::vector<std::unique_ptr<Element[]>> blocks_;
  std::size_t size_ = 0;
};

}  // namespace dyop::toi_internal
