// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "dyop/core/batch_options.h"

namespace dyop {
namespace {

class AfterTwoQuestions final : public Interrupt {
 public:
  bool is_over() override { return ++asked_ > 2; }

 private:
  int asked_ = 0;
};

// Callers' behaviour is tested in tests/haptics/interrupt_test.cpp.
TEST(InterruptPointer, IsNeverOverIfNull) {
  EXPECT_FALSE(is_over(nullptr));
}

TEST(InterruptPointer, AsksItsInterrupt) {
  AfterTwoQuestions interrupt;
  EXPECT_FALSE(is_over(&interrupt));
  EXPECT_FALSE(is_over(&interrupt));
  EXPECT_TRUE(is_over(&interrupt));
  EXPECT_TRUE(is_over(&interrupt));
}

}  // namespace
}  // namespace dyop
