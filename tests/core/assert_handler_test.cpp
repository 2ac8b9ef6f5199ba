// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstdio>

#include "dyop/core/error.h"

#ifndef DYOP_ENABLE_ASSERTS
#define DYOP_ENABLE_ASSERTS  // on here in every build
#endif
#include "core/assert.h"

namespace dyop {
namespace {

void assert_order(double lower, double upper) {
  DYOP_ASSERT(lower <= upper, lower, " and ", upper);
}

TEST(Assert, PassesWhatHolds) {
  assert_order(1, 2);
  SUCCEED() << "still running";
}

TEST(AssertDeathTest, PrintsPlaceConditionAndValuesAndAborts) {
  EXPECT_DEATH(assert_order(2.5, 1), "assert_handler_test.cpp:[0-9]+: lower <= upper: 2.5 and 1");
  EXPECT_DEATH(assert_order(std::numeric_limits<double>::quiet_NaN(), 1), "nan and 1");
}

TEST(AssertDeathTest, AsksTheHandlerOfTheHostAndAbortsAllTheSame) {
  const auto host_handler = [](const std::string& message) {
    std::fprintf(stderr, "host heard %s\n", message.c_str());
  };
  EXPECT_DEATH(
      {
        set_assert_handler(host_handler);
        assert_order(2, 1);
      },
      "host heard .*lower <= upper: 2 and 1");
}

TEST(Assert, ReturnsTheHandlerBefore) {
  const AssertHandler handler = [](const std::string&) {};
  EXPECT_EQ(set_assert_handler(handler), nullptr);
  EXPECT_EQ(set_assert_handler(nullptr), handler);
}

}  // namespace
}  // namespace dyop
