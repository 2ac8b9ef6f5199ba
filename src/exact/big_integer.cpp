// SPDX-License-Identifier: BSD-3-Clause
#include "exact/big_integer.h"

#include <bit>
#include <cmath>
#include <utility>

namespace dyop::exact_internal {
namespace {

__extension__ typedef unsigned __int128 DoubleLimb;

using Limb = LimbBuffer::Limb;

constexpr int kLimbBits = 64;
constexpr int kMantissaBits = 53;

int compare(const LimbBuffer& x, const LimbBuffer& y) {
  if (x.size() != y.size()) return x.size() < y.size() ? -1 : 1;
  for (std::size_t i = x.size(); i-- > 0;) {
    if (x[i] != y[i]) return x[i] < y[i] ? -1 : 1;
  }
  return 0;
}

LimbBuffer add(const LimbBuffer& longer, const LimbBuffer& shorter) {
  LimbBuffer total(longer.size() + 1);
  Limb* const digits = total.data();
  const Limb* const x = longer.data();
  const Limb* const y = shorter.data();
  Limb carry = 0;
  for (std::size_t i = 0; i < longer.size(); ++i) {
    const DoubleLimb digit =
        static_cast<DoubleLimb>(x[i]) + (i < shorter.size() ? y[i] : 0) + carry;
    digits[i] = static_cast<Limb>(digit);
    carry = static_cast<Limb>(digit >> kLimbBits);
  }
  digits[longer.size()] = carry;
  return total;
}

LimbBuffer subtract(const LimbBuffer& larger, const LimbBuffer& smaller) {
  LimbBuffer difference(larger.size());
  Limb* const digits = difference.data();
  const Limb* const x = larger.data();
  const Limb* const y = smaller.data();
  Limb borrow = 0;
  for (std::size_t i = 0; i < larger.size(); ++i) {
    const DoubleLimb digit =
        static_cast<DoubleLimb>(x[i]) - (i < smaller.size() ? y[i] : 0) - borrow;
    digits[i] = static_cast<Limb>(digit);
    borrow = (digit >> kLimbBits) != 0 ? 1 : 0;
  }
  return difference;
}

}  // namespace

int lowest_exponent(double x) {
  int exponent = 0;
  const double fraction = std::frexp(std::abs(x), &exponent);
  const auto mantissa = static_cast<std::uint64_t>(std::ldexp(fraction, kMantissaBits));
  return exponent - kMantissaBits + std::countr_zero(mantissa);
}

BigInteger::BigInteger(std::int64_t value) : limbs_(value != 0 ? 1 : 0), is_negative_(value < 0) {
  // Negating in the unsigned type is defined even for the most negative value.
  const auto bits = static_cast<Limb>(value);
  if (value != 0) limbs_[0] = is_negative_ ? Limb{0} - bits : bits;
}

BigInteger::BigInteger(LimbBuffer limbs, bool is_negative) : limbs_(std::move(limbs)) {
  limbs_.trim();
  is_negative_ = is_negative && !limbs_.empty();
}

BigInteger BigInteger::from_scaled(double x, int exponent) {
  if (x == 0) return {};
  const int lowest = lowest_exponent(x);
  const auto odd_part = static_cast<std::int64_t>(std::ldexp(x, -lowest));
  return BigInteger(odd_part) << (lowest - exponent);
}

int BigInteger::bit_length() const {
  if (limbs_.empty()) return 0;
  const Limb highest = limbs_[limbs_.size() - 1];
  return static_cast<int>(limbs_.size()) * kLimbBits - std::countl_zero(highest);
}

BigInteger BigInteger::operator-() const {
  return BigInteger(limbs_, !is_negative_);
}

BigInteger BigInteger::operator<<(int bits) const {
  if (limbs_.empty() || bits == 0) return *this;
  const auto whole = static_cast<std::size_t>(bits / kLimbBits);
  const int part = bits % kLimbBits;
  LimbBuffer shifted(limbs_.size() + whole + 1);
  for (std::size_t i = 0; i < limbs_.size(); ++i) {
    shifted[i + whole] |= limbs_[i] << part;
    if (part != 0) shifted[i + whole + 1] = limbs_[i] >> (kLimbBits - part);
  }
  return BigInteger(std::move(shifted), is_negative_);
}

BigInteger BigInteger::sum(const BigInteger& x, const BigInteger& y, bool is_y_negative) {
  const int order = compare(x.limbs_, y.limbs_);
  const LimbBuffer& larger = order >= 0 ? x.limbs_ : y.limbs_;
  const LimbBuffer& smaller = order >= 0 ? y.limbs_ : x.limbs_;
  if (x.is_negative_ == is_y_negative) return BigInteger(add(larger, smaller), is_y_negative);
  return BigInteger(subtract(larger, smaller), order >= 0 ? x.is_negative_ : is_y_negative);
}

BigInteger operator+(const BigInteger& x, const BigInteger& y) {
  if (x.is_zero()) return y;
  return y.is_zero() ? x : BigInteger::sum(x, y, y.is_negative_);
}

BigInteger operator-(const BigInteger& x, const BigInteger& y) {
  if (x.is_zero()) return -y;
  return y.is_zero() ? x : BigInteger::sum(x, y, !y.is_negative_);
}

BigInteger operator*(const BigInteger& x, const BigInteger& y) {
  if (x.is_zero() || y.is_zero()) return {};
  LimbBuffer product(x.limbs_.size() + y.limbs_.size());
  const Limb* const y_limbs = y.limbs_.data();
  for (std::size_t i = 0; i < x.limbs_.size(); ++i) {
    Limb* const row = product.data() + i;
    const Limb factor = x.limbs_[i];
    Limb carry = 0;
    for (std::size_t j = 0; j < y.limbs_.size(); ++j) {
      const DoubleLimb digit = static_cast<DoubleLimb>(factor) * y_limbs[j] + row[j] + carry;
      row[j] = static_cast<Limb>(digit);
      carry = static_cast<Limb>(digit >> kLimbBits);
    }
    row[y.limbs_.size()] = carry;
  }
  return BigInteger(std::move(product), x.is_negative_ != y.is_negative_);
}

}  // namespace dyop::exact_internal
