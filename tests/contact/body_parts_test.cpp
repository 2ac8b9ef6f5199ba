// SPDX-License-Identifier: BSD-3-Clause
#include "contact/solver/body_parts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "support/inputs/contact_scenes.h"
#include "support/inputs/random_inputs.h"

namespace dyop::contact_internal {
namespace {

using dyop::testing::random_index;

// Every block is in one region, in its order, and every body once in the list; regions of a phase
// share no body.
void expect_apart(const ContactSystem& system, const BodyParts& parts) {
  std::vector<std::size_t> seen;
  std::map<std::pair<std::size_t, int>, std::size_t> owner;  // by phase and body
  for (std::size_t r = 0; r < parts.regions().size(); ++r) {
    const BodyParts::Region& region = parts.regions()[r];
    EXPECT_LT(region.phase, BodyParts::kPhases);
    EXPECT_TRUE(r == 0 || parts.regions()[r - 1].phase <= region.phase);
    EXPECT_TRUE(std::is_sorted(region.blocks.begin(), region.blocks.end()));
    seen.insert(seen.end(), region.blocks.begin(), region.blocks.end());
    for (const std::size_t i : region.blocks) {
      for (const int slot : {system.blocks()[i].slot_a, system.blocks()[i].slot_b}) {
        if (slot < 0) continue;
        EXPECT_EQ(owner.try_emplace({region.phase, slot}, r).first->second, r);
      }
    }
  }
  EXPECT_EQ(seen.size(), system.blocks().size());
  EXPECT_EQ(std::set(seen.begin(), seen.end()).size(), seen.size());
  std::vector<std::size_t> bodies = parts.bodies();
  std::sort(bodies.begin(), bodies.end());
  ASSERT_EQ(bodies.size(), system.velocities().size());
  for (std::size_t i = 0; i < bodies.size(); ++i) EXPECT_EQ(bodies[i], i);
}

TEST(BodyParts, RegionsOfOnePhaseShareNoBody) {
  std::mt19937_64 random(91);
  BodyParts parts;  // one for all
  for (int i = 0; i < 40; ++i) {
    testing::RandomContacts wanted;
    wanted.bodies = 2 + random_index(900, random);
    wanted.contacts = random_index(4000, random);
    ContactSystem system;
    system.build(testing::random_contact_problem(wanted, random));
    parts.cut(system);
    expect_apart(system, parts);
  }
}

// Most contacts of a wall are within parts, and parts are equal.
TEST(BodyParts, OfAWallAreWideAndTouchAlongShortLines) {
  ContactSystem system;
  system.build(testing::wall_scene(40, 20));
  BodyParts parts;
  parts.cut(system);
  expect_apart(system, parts);
  std::vector<std::size_t> sizes;
  std::size_t within = 0;
  for (const BodyParts::Region& region : parts.regions()) {
    if (region.phase != 0) continue;
    sizes.push_back(region.blocks.size());
    within += region.blocks.size();
  }
  EXPECT_EQ(sizes.size(), BodyParts::kMostParts);
  EXPECT_GT(10 * within, 7 * system.blocks().size());
  EXPECT_LT(*std::max_element(sizes.begin(), sizes.end()),
            2 * *std::min_element(sizes.begin(), sizes.end()));
}

TEST(BodyParts, OfFewContactsAreOne) {
  ContactSystem system;
  system.build(testing::pile_scene(4, 4));
  BodyParts parts;
  parts.cut(system);
  EXPECT_EQ(parts.regions().size(), 1u);
  expect_apart(system, parts);
}

}  // namespace
}  // namespace dyop::contact_internal
