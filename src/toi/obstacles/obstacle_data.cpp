// SPDX-License-Identifier: BSD-3-Clause
#include "toi/obstacles/obstacle_data.h"

#include <algorithm>

#include "dyop/core/error.h"

namespace dyop::toi_internal {

const ObstacleSetData::Slot* ObstacleSetData::find(ObstacleId id) const {
  const auto slot = static_cast<std::uint32_t>(id);
  if (slot >= slots.size() || !slots[slot].obstacle || id_of(slot) != id) return nullptr;
  return &slots[slot];
}

void ObstacleSetData::put_in(std::uint32_t slot) {
  slots[slot].is_in_tree = false;
  if (slots[slot].is_at_rest) {
    loose.push_back(slot);
    tidy();
  } else {
    loose.insert(loose.begin(), slot);
    ++moving;
  }
}

void ObstacleSetData::take_out(std::uint32_t slot) {
  if (slots[slot].is_in_tree) {
    slots[slot].is_in_tree = false;
    ++left_tree;
    return;
  }
  if (!slots[slot].is_at_rest) --moving;
  loose.erase(std::find(loose.begin(), loose.end(), slot));
}

// Rebuilds rarely enough that each obstacle is put into a new tree a bounded number of times.
void ObstacleSetData::tidy() {
  constexpr std::size_t kFew = 16;
  constexpr std::size_t kShare = 4;
  if (loose.size() - moving + left_tree <= kFew + tree.item_count() / kShare) return;
  std::vector<ObstacleTree::Item> items;
  for (std::uint32_t i = 0; i < slots.size(); ++i) {
    Slot& slot = slots[i];
    slot.is_in_tree = slot.obstacle && slot.is_at_rest;
    if (slot.is_in_tree) items.push_back({slot.box, i});
  }
  tree = ObstacleTree(std::move(items));
  left_tree = 0;
  loose.resize(moving);
}

void require_no_solid_b(const char* query, bool solid_b) {
  DYOP_REQUIRE(!solid_b, query, ": solid_b must be false; use Obstacle::is_solid");
}

}  // namespace dyop::toi_internal
