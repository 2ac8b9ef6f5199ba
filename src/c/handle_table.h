// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <vector>

namespace dyop::c {

/// Objects by handle, an index and a generation. A reused slot has a new generation; a slot whose
/// generations are used up is not reused. Tables number generations differently, so that a handle
/// of one table, as of a context that is gone, means nothing to another.
template <typename Object>
class HandleTable {
 public:
  explicit HandleTable(std::pmr::memory_resource* memory) : slots_(memory), free_(memory) {}

  /// Handle is any struct of an index and a generation.
  template <typename Handle>
  Handle add(std::shared_ptr<Object> object) {
    if (free_.empty()) {
      free_.push_back(static_cast<std::uint32_t>(slots_.size()));
      slots_.emplace_back();
    }
    const std::uint32_t index = free_.back();
    free_.pop_back();
    Slot& slot = slots_[index];
    slot.object = std::move(object);
    ++slot.generation;
    if (slot.generation == mask_) ++slot.generation;  // its handle could be zero
    return {index, slot.generation ^ mask_};
  }

  /// Null if the handle is stale.
  template <typename Handle>
  std::shared_ptr<Object> find(const Handle& handle) const {
    if (handle.index >= slots_.size()) return nullptr;
    const Slot& slot = slots_[handle.index];
    return (slot.generation ^ mask_) == handle.generation ? slot.object : nullptr;
  }

  /// False if the handle is stale.
  template <typename Handle>
  bool remove(const Handle& handle) {
    if (!find(handle)) return false;
    Slot& slot = slots_[handle.index];
    slot.object.reset();
    if (slot.generation < ~std::uint32_t{0}) free_.push_back(handle.index);
    return true;
  }

 private:
  struct Slot {
    std::shared_ptr<Object> object;
    std::uint32_t generation = 0;
  };

  // The n-th mask differs from earlier ones in high bits, so that generations would have to differ by
  // very much to make the same handle. Below the last generation.
  static std::uint32_t next_mask() {
    static std::atomic<std::uint32_t> count{0};
    constexpr std::uint32_t kGoldenRatio = 0x9E3779B9;  // its multiples spread evenly
    return (++count * kGoldenRatio) >> 1;
  }

  const std::uint32_t mask_ = next_mask();
  std::pmr::vector<Slot> slots_;
  std::pmr::vector<std::uint32_t> free_;
};

}  // namespace dyop::c
