// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>

#include "motion/curve/bernstein.h"
#include "motion/random_values.h"

namespace dyop::testing {
namespace {

using motion_internal::SpeedTree;

TEST(SpeedTree, FindsTheLargestOfEveryRange) {
  Random random(1);
  for (std::size_t count = 1; count <= 20; ++count) {
    std::vector<SpeedTree::Speeds> pieces(count);
    for (auto& piece : pieces) piece = {random.uniform(0, 1), random.uniform(0, 1)};
    const SpeedTree tree(pieces);
    for (std::size_t first = 0; first < count; ++first) {
      SpeedTree::Speeds expected;
      for (std::size_t last = first; last < count; ++last) {
        expected = {std::max(expected.linear, pieces[last].linear),
                    std::max(expected.angular, pieces[last].angular)};
        EXPECT_EQ(tree.largest(first, last).linear, expected.linear);
        EXPECT_EQ(tree.largest(first, last).angular, expected.angular);
      }
    }
  }
}

TEST(SpeedTree, AnEmptyRangeIsZero) {
  EXPECT_EQ(SpeedTree({{3, 4}, {5, 6}}).largest(1, 0).linear, 0);
}

}  // namespace
}  // namespace dyop::testing
