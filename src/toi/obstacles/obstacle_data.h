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
    bool is_in_tree = false;  // otherwise in `loose`; a leaf of the tree may be out of date
    AlignedBox box;           // of an obstacle at rest, in world
  };

  std::vector<Slot> slots;
  std::vector<std::uint32_t> free;
  std::size_t size = 0;
  ObstacleTree tree;                 // of obstacles at rest, some of which may have left it
  std::size_t left_tree = 0;         // how many left it
  std::vector<std::uint32_t> loose;  // the others, moving ones first
  std::size_t moving = 0;            // how many of them

  ObstacleId id_of(std::uint32_t slot) const {
    return ObstacleId{std::uint64_t{slots[slot].uses} << 32 | slot};
  }
  const Slot* find(ObstacleId id) const;
  /// Lists an obstacle that is new or was taken out.
  void put_in(std::uint32_t slot);
  /// Removes an obstacle from the tree or the loose list.
  void take_out(std::uint32_t slot);
  /// Rebuilds the tree with all obstacles at rest, if many are not in it.
  void tidy();
};

/// Throws InvalidArgument if solid_b is set: Obstacle::is_solid replaces it.
void require_no_solid_b(const char* query, bool solid_b);

/// Whether a query considers this obstacle.
inline bool passes(const ObstacleSetData& data, std::uint32_t slot, const ObstacleFilter& filter) {
  if ((data.slots[slot].obstacle->groups & filter.groups) == 0) return false;
  return !filter.accepts || filter.accepts(data.id_of(slot));
}

}  // namespace dyop::toi_internal
