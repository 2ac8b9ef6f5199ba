// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/core/error.h"

#include <gtest/gtest.h>

#include <limits>

#include "dyop/core/types.h"

namespace dyop {
namespace {

using core_internal::compose_message;

TEST(ErrorMessage, HasTheShortestNumberThatReadsBack) {
  EXPECT_EQ(compose_message("not ", 0.1), "not 0.1");
  EXPECT_EQ(compose_message(1e60), "1e+60");
  EXPECT_EQ(compose_message(1.0 / 3), "0.3333333333333333");
  EXPECT_EQ(compose_message(0.1f), "0.1");
  EXPECT_EQ(compose_message(-2.0), "-2");
  EXPECT_EQ(compose_message(std::numeric_limits<double>::quiet_NaN()), "nan");
  EXPECT_EQ(compose_message(-std::numeric_limits<double>::quiet_NaN()), "nan");
  EXPECT_EQ(compose_message(-kInfinity), "-inf");
}

TEST(ErrorMessage, HasAllNumbersOfAVector) {
  const Vector3 v(0.1, -2, 1e60);
  EXPECT_EQ(compose_message('(', v.transpose(), ')'), "(0.1 -2 1e+60)");
  EXPECT_EQ(compose_message(v), "0.1 -2 1e+60");
}

TEST(ErrorMessage, JoinsItsParts) {
  EXPECT_EQ(compose_message("triangle ", 3, " of ", std::string("a.obj"), ':', true),
            "triangle 3 of a.obj:1");
}

TEST(Require, ThrowsForAFalseConditionAndForNaN) {
  const auto require_positive = [](double x) { DYOP_REQUIRE(x > 0, "x must be > 0, not ", x); };
  EXPECT_NO_THROW(require_positive(1));
  EXPECT_THROW(require_positive(std::numeric_limits<double>::quiet_NaN()), InvalidArgument);
  try {
    require_positive(-0.3);
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_STREQ(error.what(), "x must be > 0, not -0.3");
  }
}

}  // namespace
}  // namespace dyop
