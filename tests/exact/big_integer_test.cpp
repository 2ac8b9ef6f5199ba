// SPDX-License-Identifier: BSD-3-Clause
#include "exact/big_integer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace dyop::exact_internal {
namespace {

__extension__ typedef __int128 Wide;

// Exact for numbers below 2^126.
BigInteger from_wide(Wide value) {
  const bool is_negative = value < 0;
  Wide rest = is_negative ? -value : value;
  BigInteger whole;
  for (int shift = 0; rest != 0; shift += 32) {
    whole = whole + (BigInteger(static_cast<std::int64_t>(rest & 0xffffffff)) << shift);
    rest >>= 32;
  }
  return is_negative ? -whole : whole;
}

// A number of about `limbs` words with random low bits.
BigInteger random_number(int limbs, std::mt19937_64& random) {
  BigInteger x = static_cast<std::int64_t>(random());
  for (int i = 1; i < limbs; ++i) x = (x << 61) + static_cast<std::int64_t>(random());
  return x;
}

TEST(BigInteger, AgreesWithWideBuiltInNumbers) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 20000; ++i) {
    const int shift = static_cast<int>(random() % 62);
    const auto x = static_cast<std::int64_t>(random()) >> shift;
    const auto y = static_cast<std::int64_t>(random()) >> (61 - shift);
    EXPECT_EQ(BigInteger(x) + y, from_wide(static_cast<Wide>(x) + y));
    EXPECT_EQ(BigInteger(x) - y, from_wide(static_cast<Wide>(x) - y));
    EXPECT_EQ(BigInteger(x / 2) * (y / 2), from_wide(static_cast<Wide>(x / 2) * (y / 2)));
  }
}

TEST(BigInteger, ObeysTheLawsOfArithmeticAtAllSizes) {
  std::mt19937_64 random(2);
  for (int limbs = 1; limbs <= 40; ++limbs) {
    const BigInteger x = random_number(limbs, random);
    const BigInteger y = random_number(1 + limbs / 2, random);
    const BigInteger z = random_number(3, random);
    EXPECT_EQ((x + y) * (x - y), x * x - y * y);
    EXPECT_EQ((x + y) - y, x);
    EXPECT_EQ(x * (y + z), x * y + x * z);
    EXPECT_EQ((x - x).sign(), 0);
    EXPECT_EQ((x - x).bit_length(), 0);
    EXPECT_EQ(x.sign() * y.sign(), (x * y).sign());
  }
}

TEST(BigInteger, ShiftsAreProductsWithPowersOfTwo) {
  std::mt19937_64 random(3);
  const BigInteger x = random_number(5, random);
  BigInteger power = 1;
  for (int bits = 0; bits < 200; ++bits, power = power + power) {
    EXPECT_EQ(x << bits, x * power);
    EXPECT_EQ((x << bits).bit_length(), x.bit_length() + bits);
  }
}

TEST(BigInteger, TakesEveryFiniteDoubleExactly) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 2000; ++i) {
    const int exponent = static_cast<int>(random() % 1800) - 900;
    const double x = std::ldexp(static_cast<double>(static_cast<std::int64_t>(random())), exponent);
    const int lowest = lowest_exponent(x);
    EXPECT_EQ(std::fmod(std::ldexp(x, -lowest), 2.0), x > 0 ? 1.0 : -1.0);
    const BigInteger odd = BigInteger::from_scaled(x, lowest);
    EXPECT_EQ(odd, static_cast<std::int64_t>(std::ldexp(x, -lowest)));
    EXPECT_EQ(BigInteger::from_scaled(x, lowest - 77), odd << 77);
  }
  EXPECT_EQ(lowest_exponent(std::numeric_limits<double>::denorm_min()), -1074);
  EXPECT_EQ(BigInteger::from_scaled(0.0, 5).sign(), 0);
}

TEST(BigInteger, TakesTheMostNegativeWord) {
  const BigInteger least = std::numeric_limits<std::int64_t>::min();
  EXPECT_EQ(least, -(BigInteger(1) << 63));
  EXPECT_EQ(least.sign(), -1);
}

}  // namespace
}  // namespace dyop::exact_internal
