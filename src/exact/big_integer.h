// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

namespace dyop::exact_internal {

// The digits of an integer, lowest first. Short ones are stored inside the object: nearly all
// numbers of an exact decision are short, and allocating would take longer than computing.
class LimbBuffer {
 public:
  using Limb = std::uint64_t;

  LimbBuffer() = default;
  // Zeros.
  explicit LimbBuffer(std::size_t size) : size_(size) {
    if (size > kInside) {
      outside_.assign(size, 0);
    } else {
      std::fill_n(inside_.begin(), size, Limb{0});
    }
  }
  LimbBuffer(const LimbBuffer& other) : size_(other.size_), outside_(other.outside_) {
    copy_inside(other);
  }
  LimbBuffer(LimbBuffer&& other) noexcept
      : size_(std::exchange(other.size_, 0)), outside_(std::move(other.outside_)) {
    copy_inside(other);
    other.outside_.clear();
  }
  LimbBuffer& operator=(LimbBuffer other) noexcept {
    size_ = other.size_;
    outside_.swap(other.outside_);
    copy_inside(other);
    return *this;
  }
  ~LimbBuffer() = default;

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  Limb* data() { return outside_.empty() ? inside_.data() : outside_.data(); }
  const Limb* data() const { return outside_.empty() ? inside_.data() : outside_.data(); }
  Limb& operator[](std::size_t i) { return data()[i]; }
  Limb operator[](std::size_t i) const { return data()[i]; }

  // Drops leading zeros. A long number stays where it is.
  void trim() {
    const Limb* limbs = data();
    while (size_ > 0 && limbs[size_ - 1] == 0) --size_;
  }

  friend bool operator==(const LimbBuffer& x, const LimbBuffer& y) {
    return x.size_ == y.size_ && std::equal(x.data(), x.data() + x.size_, y.data());
  }

 private:
  // The whole buffer, in a few moves: most numbers fill half of it, and a copy of unknown length
  // costs a function call.
  void copy_inside(const LimbBuffer& other) {
    if (outside_.empty()) std::memcpy(inside_.data(), other.inside_.data(), sizeof(inside_));
  }

  static constexpr std::size_t kInside = 10;

  std::size_t size_ = 0;
  std::array<Limb, kInside> inside_;  // the first size_ are set, unless outside_ is used
  std::vector<Limb> outside_;
};

// An integer of any size, with what exact predicates need: sums, products, shifts and signs.
class BigInteger {
 public:
  BigInteger() = default;
  BigInteger(std::int64_t value);  // implicit: literals occur in formulas

  // x / 2^exponent, which must be an integer; x finite.
  static BigInteger from_scaled(double x, int exponent);

  int sign() const { return limbs_.empty() ? 0 : is_negative_ ? -1 : 1; }
  bool is_zero() const { return limbs_.empty(); }
  int bit_length() const;

  BigInteger operator-() const;
  BigInteger operator<<(int bits) const;
  friend BigInteger operator+(const BigInteger& x, const BigInteger& y);
  friend BigInteger operator-(const BigInteger& x, const BigInteger& y);
  friend BigInteger operator*(const BigInteger& x, const BigInteger& y);
  friend bool operator==(const BigInteger&, const BigInteger&) = default;

 private:
  BigInteger(LimbBuffer limbs, bool is_negative);
  static BigInteger sum(const BigInteger& x, const BigInteger& y, bool is_y_negative);

  LimbBuffer limbs_;          // the highest is never zero
  bool is_negative_ = false;  // never set for zero
};

// The exponent e of the lowest set bit of x: x is an integer multiple of 2^e and of no higher power
// of two. x finite and not zero.
int lowest_exponent(double x);

}  // namespace dyop::exact_internal
