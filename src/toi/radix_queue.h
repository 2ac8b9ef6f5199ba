// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "core/assert.h"
#include "dyop/core/types.h"

namespace dyop::toi_internal {

/// A pair of tree boxes and the time before which they are proven more than the floor apart.
struct QueuedPair {
  Scalar time;
  std::int32_t a;
  std::int32_t b;
};

/// Priority queue, earliest first, for times that are never earlier than the last one popped: a
/// radix heap [Ahuja1990] on the bits of the time. A pair moves at most 64 times, in practice two
/// or three, always to the end of an array; there is no scale to choose, whatever the motion. Pairs
/// of equal time are ordered by when they were pushed. Keeps its memory when cleared.
class RadixQueue {
 public:
  bool is_empty() const { return size_ == 0; }
  std::int64_t size() const { return size_; }

  void clear() {
    if (size_ > 0) {
      for (std::vector<QueuedPair>& bucket : buckets_) bucket.clear();
    }
    occupied_ = 0;
    size_ = 0;
    last_ = 0;
  }

  void reserve(std::size_t count) {
    for (std::vector<QueuedPair>& bucket : buckets_) bucket.reserve(count);
  }

  // Up to eight per pair of boxes; calls cost 2 % of a query.
  [[gnu::always_inline]] void push(const QueuedPair& pair) {
    DYOP_ASSERT(pair.time == pair.time, pair.a, ' ', pair.b);
    const std::uint64_t key = key_of(pair.time);
    add(key < last_ ? last_ : key, pair);
    ++size_;
  }

  /// The earliest pair; the queue must not be empty.
  QueuedPair pop() {
    DYOP_ASSERT(size_ > 0, size_);
    if (buckets_[0].empty()) advance();
    const QueuedPair pair = buckets_[0].back();
    buckets_[0].pop_back();
    --size_;
    return pair;
  }

 private:
  // Unsigned integers in the order of the times.
  static std::uint64_t key_of(Scalar time) {
    const auto bits = std::bit_cast<std::uint64_t>(time + 0.0);  // -0 becomes 0
    constexpr std::uint64_t kSign = std::uint64_t{1} << 63;
    return (bits & kSign) != 0 ? ~bits : bits | kSign;
  }

  // Bucket k > 0 holds keys that differ from last_ in bit k - 1 and agree above.
  [[gnu::always_inline]] void add(std::uint64_t key, const QueuedPair& pair) {
    const auto k = static_cast<int>(std::bit_width(key ^ last_));
    if (k > 0) occupied_ |= std::uint64_t{1} << (k - 1);
    buckets_[std::size_t(k)].push_back(pair);
  }

  // Makes the smallest key the last one, and distributes its bucket over the lower ones.
  void advance() {
    DYOP_ASSERT(occupied_ != 0, size_);
    const int k = 1 + std::countr_zero(occupied_);
    std::vector<QueuedPair>& bucket = buckets_[std::size_t(k)];
    occupied_ &= occupied_ - 1;
    DYOP_ASSERT(!bucket.empty(), k);
    std::uint64_t smallest = key_of(bucket[0].time);
    for (const QueuedPair& pair : bucket) {
      const std::uint64_t key = key_of(pair.time);
      if (key < smallest) smallest = key;
    }
    DYOP_ASSERT(smallest >= last_, smallest, ' ', last_);
    last_ = smallest;
    for (const QueuedPair& pair : bucket) add(key_of(pair.time), pair);
    bucket.clear();
  }

  std::array<std::vector<QueuedPair>, 65> buckets_;
  std::uint64_t occupied_ = 0;  // bit k - 1: bucket k is not empty
  std::uint64_t last_ = 0;
  std::int64_t size_ = 0;
};

}  // namespace dyop::toi_internal
