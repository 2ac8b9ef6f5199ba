// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/core/time_interval.h"

#include <gtest/gtest.h>

namespace dyop {
namespace {

TEST(TimeInterval, ReversedIsAnErrorNamingBothEnds) {
  try {
    require_valid({2, 1});
    FAIL() << "no error";
  } catch (const InvalidArgument& error) {
    EXPECT_STREQ(error.what(), "time interval must not be reversed: begin 2 > end 1");
  }
}

TEST(TimeInterval, NonFiniteIsAnError) {
  EXPECT_THROW(require_valid({0, kInfinity}), InvalidArgument);
  EXPECT_THROW(require_valid({std::nan(""), 1}), InvalidArgument);
}

TEST(TimeInterval, ZeroLengthIsLegal) {
  EXPECT_NO_THROW(require_valid({3, 3}));
}

}  // namespace
}  // namespace dyop
