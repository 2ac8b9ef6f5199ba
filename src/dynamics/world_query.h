// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <unordered_map>
#include <vector>

#include "dynamics/body_record.h"
#include "dyop/dynamics/world_query.h"
#include "dyop/toi/obstacle_set.h"

namespace dyop::dynamics_internal {

/// The bodies of a World as obstacles where they stand, brought up to date by the next query after
/// a change; what has not moved stays where it is in the tree.
class BodyObstacles {
 public:
  /// @param revision Another one after every change of the bodies.
  void update(const std::deque<BodyRecord>& bodies, std::uint64_t revision);
  const ObstacleSet& set() const { return set_; }
  /// In terms of the set; lives no longer than the filter.
  ObstacleFilter filter(const std::deque<BodyRecord>& bodies, const BodyFilter& filter) const;
  std::optional<BodyId> body(const std::deque<BodyRecord>& bodies,
                             const std::optional<ObstacleId>& id) const;

 private:
  struct Entry {  // by slot
    std::optional<ObstacleId> id;
    std::shared_ptr<const Shape> shape;
    RigidPose X_WB;
  };

  ObstacleSet set_;
  std::vector<Entry> entries_;
  std::unordered_map<std::uint64_t, std::uint32_t> slots_;  // by id
  std::optional<std::uint64_t> revision_;
};

}  // namespace dyop::dynamics_internal
