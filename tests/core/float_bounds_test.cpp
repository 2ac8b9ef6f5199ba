// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <random>

#include "core/tolerance.h"

namespace dyop::core_internal {
namespace {

using Triple = std::array<float, 3>;

// Side by side, as the boxes of a tree and the rows of a recording hold them.
[[gnu::noinline]] Triple above(const Vector3& v) {
  return {float_above(v.x()), float_above(v.y()), float_above(v.z())};
}

[[gnu::noinline]] Triple below(const Vector3& v) {
  return {float_below(v.x()), float_below(v.y()), float_below(v.z())};
}

// What a float holds after it went through memory, whatever the optimiser knew of it.
Scalar stored(float x) {
  std::array<volatile unsigned char, sizeof x> bytes{};
  std::array<unsigned char, sizeof x> copy{};
  std::memcpy(copy.data(), &x, sizeof x);
  for (std::size_t i = 0; i < sizeof x; ++i) bytes[i] = copy[i];
  for (std::size_t i = 0; i < sizeof x; ++i) copy[i] = bytes[i];
  float read = 0;
  std::memcpy(&read, copy.data(), sizeof read);
  return Scalar(read);
}

TEST(FloatBounds, AreTheNearestOnTheirSideAlsoSideBySide) {
  std::mt19937_64 random(20261123);
  std::uniform_real_distribution<Scalar> mantissa(-1, 1);
  std::uniform_int_distribution<int> exponent(-30, 30);
  int inexact = 0;
  for (int n = 0; n < 200'000; ++n) {
    Vector3 v;
    for (int k = 0; k < 3; ++k) v[k] = std::ldexp(mantissa(random), exponent(random));
    const Triple high = above(v);
    const Triple low = below(v);
    for (std::size_t k = 0; k < 3; ++k) {
      const Scalar x = v[Eigen::Index(k)];
      ASSERT_EQ(Scalar(high[k]), stored(high[k])) << x;
      ASSERT_EQ(Scalar(low[k]), stored(low[k])) << x;
      ASSERT_GE(stored(high[k]), x);
      ASSERT_LE(stored(low[k]), x);
      ASSERT_LE(stored(std::nextafter(low[k], high[k])), stored(high[k])) << "not the nearest";
      inexact += high[k] != low[k];
    }
  }
  EXPECT_GT(inexact, 500'000);
}

TEST(FloatBounds, HandleWhatFloatsCannotHold) {
  const float infinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(float_above(1e300), infinity);
  EXPECT_EQ(float_below(1e300), std::numeric_limits<float>::max());
  EXPECT_EQ(float_above(0), 0.0f);
  EXPECT_GT(float_above(1e-300), 0.0f);
  EXPECT_EQ(float_below(1e-300), 0.0f);
  EXPECT_TRUE(std::isnan(float_above(std::numeric_limits<Scalar>::quiet_NaN())));
}

}  // namespace
}  // namespace dyop::core_internal
