// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "exact/limb_buffer.h"

namespace dyop::exact_internal {

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
