// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "dyop/toi/obstacle_set.h"
#include "toi/obstacles/obstacle_tree.h"

namespace dyop::toi_internal {

/// The contents of an ObstacleSet. Obstacles live in slots that are reused; an id is a slot and the
/// number of times it was used before.
struct ObstacleSetData {
  struct Slot {
    std::optional<Obstacle> obstacle;
    std::uint32_t uses = 0;
    bool is_at_rest = false;
    std::int32_t leaf = ObstacleTree::kNone;  // in the tree, of an obstacle at rest
    std::size_t place = 0;                    // in `moving`, of another
    AlignedBox box;                           // of an obstacle at rest, in world
  };

  std::vector<Slot> slots;
  std::vector<std::uint32_t> free;
  std::size_t size = 0;
  ObstacleTree tree;                  // of obstacles at rest
  std::vector<std::uint32_t> moving;  // slots of the others, in any order

  ObstacleId id_of(std::uint32_t slot) const {
    return ObstacleId{std::uint64_t{slots[slot].uses} << 32 | slot};
  }
  const Slot* find(ObstacleId id) const;
  /// Lists an obstacle that is new or was taken out.
  void put_in(std::uint32_t slot);
  /// Removes an obstacle from where it is listed.
  void take_out(std::uint32_t slot);
};

/// Throws InvalidArgument if solid_b is set: Obstacle::is_solid replaces it.
void require_no_solid_b(const char* query, bool solid_b);

/// Whether a query considers this obstacle.
inline bool passes(const ObstacleSetData& data, std::uint32_t slot, const ObstacleFilter& filter) {
  if ((data.slots[slot].obstacle->groups & filter.groups) == 0) return false;
  return !filter.accepts || filter.accepts(data.id_of(slot));
}

}  // namespace dyop::toi_internal
