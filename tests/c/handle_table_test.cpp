// SPDX-License-Identifier: BSD-3-Clause
#include "c/handle_table.h"

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <random>
#include <set>
#include <vector>

#include "dyop/dyop_c.h"

namespace dyop::c {
namespace {

TEST(HandleTable, FindsWhatALedgerOfHandlesFinds) {
  HandleTable<int> table(std::pmr::get_default_resource());
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> living;
  std::vector<dyop_shape> all;
  std::mt19937 random(1);
  for (int i = 0; i < 20000; ++i) {
    if (random() % 2 == 0 || all.empty()) {
      const auto handle = table.add<dyop_shape>(std::make_shared<int>(i));
      const bool is_new = living.emplace(std::pair(handle.index, handle.generation), i).second;
      ASSERT_TRUE(is_new);
      all.push_back(handle);
    } else {
      const dyop_shape handle = all[random() % all.size()];
      ASSERT_EQ(table.remove(handle), living.erase({handle.index, handle.generation}) == 1);
    }
    const dyop_shape asked = all[random() % all.size()];
    const auto expected = living.find({asked.index, asked.generation});
    const std::shared_ptr<int> found = table.find(asked);
    ASSERT_EQ(found != nullptr, expected != living.end());
    ASSERT_TRUE(!found || *found == expected->second);
  }
}

TEST(HandleTable, HandlesMeanNothingToOtherTables) {
  constexpr int kTables = 100;
  constexpr int kHandles = 50;
  std::vector<std::unique_ptr<HandleTable<int>>> tables;
  std::set<std::pair<std::uint32_t, std::uint32_t>> all;
  for (int i = 0; i < kTables; ++i) {
    tables.push_back(std::make_unique<HandleTable<int>>(std::pmr::get_default_resource()));
    for (int k = 0; k < kHandles; ++k) {
      const auto handle = tables.back()->add<dyop_shape>(std::make_shared<int>(k));
      EXPECT_TRUE(all.emplace(handle.index, handle.generation).second);
      if (k % 2 == 0) tables.back()->remove(handle);
    }
  }
}

TEST(HandleTable, ZeroHandlesReferToNothing) {
  HandleTable<int> table(std::pmr::get_default_resource());
  EXPECT_FALSE(table.find(dyop_shape{0, 0}));
  table.add<dyop_shape>(std::make_shared<int>(1));
  EXPECT_FALSE(table.find(dyop_shape{0, 0}));
  EXPECT_FALSE(table.find(dyop_shape{7, 1}));
  EXPECT_FALSE(table.remove(dyop_shape{0, 0}));
}

}  // namespace
}  // namespace dyop::c
