// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <tuple>
#include <vector>

#include "dyop/toi/obstacle_set.h"
#include "dyop/toi/time_of_impact.h"
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

/// Something still to be examined, proven free up to `key`, a time or a distance.
struct ObstacleEvent {
  Scalar key = 0;
  int rank = 0;           ///< at equal keys: boxes of the tree before obstacles
  std::uint64_t id = 0;   ///< then the smaller id
  std::size_t index = 0;  ///< node, slot or pair

  /// For a heap with the smallest on top.
  friend bool operator<(const ObstacleEvent& x, const ObstacleEvent& y) {
    return std::tie(x.key, x.rank, x.id, x.index) > std::tie(y.key, y.rank, y.id, y.index);
  }
};

class ObstacleQueue {
 public:
  bool is_empty() const { return heap_.empty(); }
  void clear() { heap_.clear(); }
  const ObstacleEvent& top() const { return heap_.front(); }
  void push(const ObstacleEvent& event) {
    heap_.push_back(event);
    std::push_heap(heap_.begin(), heap_.end());
  }
  ObstacleEvent pop() {
    std::pop_heap(heap_.begin(), heap_.end());
    const ObstacleEvent event = heap_.back();
    heap_.pop_back();
    return event;
  }

 private:
  std::vector<ObstacleEvent> heap_;
};

/// Calls visit(slot, gap) for obstacles that pass the filter, in the order of (gap, id), while the
/// gap is at most what limit() then returns. So the order does not depend on the tree.
///
/// @param gap_of_box    Lower bound for everything in a box; never more for a larger box.
/// @param gap_of_moving Lower bound for the obstacle in a slot.
/// @returns The smallest bound of any obstacle that was not visited.
template <typename GapOfBox, typename GapOfMoving, typename Limit, typename Visit>
Scalar visit_by_gap(const ObstacleSetData& data, const ObstacleFilter& filter,
                    const GapOfBox& gap_of_box, const GapOfMoving& gap_of_moving,
                    const Limit& limit, const Visit& visit) {
  constexpr int kNode = 0;
  constexpr int kObstacle = 1;
  ObstacleQueue queue;
  const auto push_obstacle = [&](std::uint32_t slot, Scalar gap) {
    if (!passes(data, slot, filter)) return;
    queue.push({gap, kObstacle, static_cast<std::uint64_t>(data.id_of(slot)), slot});
  };
  const auto push_node = [&](std::int32_t number) {
    const ObstacleTree::Node& node = data.tree.node(number);
    if (node.is_leaf()) {
      push_obstacle(node.number, gap_of_box(node.box));
    } else {
      queue.push({gap_of_box(node.box), kNode, 0, static_cast<std::size_t>(number)});
    }
  };
  for (const std::uint32_t slot : data.moving) push_obstacle(slot, gap_of_moving(slot));
  if (data.tree.root() != ObstacleTree::kNone) push_node(data.tree.root());
  while (!queue.is_empty()) {
    if (queue.top().key > limit()) return queue.top().key;
    const ObstacleEvent event = queue.pop();
    if (event.rank == kNode) {
      for (const std::int32_t child : data.tree.node(std::int32_t(event.index)).children) {
        push_node(child);
      }
    } else {
      visit(static_cast<std::uint32_t>(event.index), event.key);
    }
  }
  return kInfinity;
}

/// The body and an obstacle, and the state of their search.
struct ObstaclePair {
  std::uint32_t slot = 0;
  TimeInterval interval;
  std::int64_t portion = 0;  ///< node pairs of the next portion
  bool is_begun = false;
  ToiResult result;
  ToiWorkspace workspace;
};

/// The contents of an ObstacleWorkspace.
struct ObstacleMemory {
  /// The body is boxed over each of so many equal parts of the interval. More: more obstacles are
  /// skipped, each for about 0.3 us, or less where the motion knows its state at their middles.
  int time_parts = 16;
  ObstacleQueue queue;
  std::vector<std::unique_ptr<ObstaclePair>> pairs;  ///< the first `used` ones belong to this query
  std::size_t used = 0;
};

}  // namespace dyop::toi_internal
