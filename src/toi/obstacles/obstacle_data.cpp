// SPDX-License-Identifier: BSD-3-Clause
#include "toi/obstacles/obstacle_data.h"

#include "dyop/core/error.h"

namespace dyop::toi_internal {

const ObstacleSetData::Slot* ObstacleSetData::find(ObstacleId id) const {
  const auto slot = static_cast<std::uint32_t>(id);
  if (slot >= slots.size() || !slots[slot].obstacle || id_of(slot) != id) return nullptr;
  return &slots[slot];
}

void ObstacleSetData::put_in(std::uint32_t number) {
  Slot& slot = slots[number];
  if (slot.is_at_rest) {
    slot.leaf = tree.insert(slot.box, number);
    return;
  }
  slot.place = moving.size();
  moving.push_back(number);
}

void ObstacleSetData::take_out(std::uint32_t number) {
  Slot& slot = slots[number];
  if (slot.is_at_rest) {
    tree.remove(slot.leaf);
    slot.leaf = ObstacleTree::kNone;
    return;
  }
  moving[slot.place] = moving.back();
  slots[moving[slot.place]].place = slot.place;
  moving.pop_back();
}

void require_no_solid_b(const char* query, bool solid_b) {
  DYOP_REQUIRE(!solid_b, query, ": solid_b must be false; use Obstacle::is_solid");
}

}  // namespace dyop::toi_internal
