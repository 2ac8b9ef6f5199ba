// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/obstacle_set.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "distance/point_search.h"
#include "dyop/core/error.h"
#include "dyop/motion/steady_motions.h"
#include "toi/obstacles/obstacle_data.h"
#include "toi/obstacles/swept_boxes.h"

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

namespace dyop {

ObstacleWorkspace::ObstacleWorkspace()
    : memory_(std::make_unique<toi_internal::ObstacleMemory>()) {}
ObstacleWorkspace::~ObstacleWorkspace() = default;
ObstacleWorkspace::ObstacleWorkspace(ObstacleWorkspace&&) noexcept = default;
ObstacleWorkspace& ObstacleWorkspace::operator=(ObstacleWorkspace&&) noexcept = default;

ObstacleSet::ObstacleSet() : data_(std::make_unique<toi_internal::ObstacleSetData>()) {}
ObstacleSet::~ObstacleSet() = default;
ObstacleSet::ObstacleSet(ObstacleSet&&) noexcept = default;
ObstacleSet& ObstacleSet::operator=(ObstacleSet&&) noexcept = default;

namespace {

using Slot = toi_internal::ObstacleSetData::Slot;

// For a slot whose obstacle is new or has a new motion.
void box_obstacle(Slot& slot) {
  const Motion& motion = *slot.obstacle->X_WO;
  slot.is_at_rest = dynamic_cast<const RestMotion*>(&motion) != nullptr;
  if (slot.is_at_rest) slot.box = toi_internal::placed_box(*slot.obstacle->shape, motion.pose(0));
}

std::uint32_t slot_of(const toi_internal::ObstacleSetData& data, ObstacleId id) {
  DYOP_REQUIRE(data.find(id), "no obstacle with id ", static_cast<std::uint64_t>(id));
  return static_cast<std::uint32_t>(id);
}

void require_usable(const Obstacle& obstacle) {
  DYOP_REQUIRE(obstacle.shape != nullptr, "an obstacle needs a shape");
  DYOP_REQUIRE(obstacle.X_WO != nullptr, "an obstacle needs a motion");
  distance_internal::require_closed("ObstacleSet::add", *obstacle.shape, *obstacle.shape,
                                    {false, obstacle.is_solid});
}

void fill_slot(toi_internal::ObstacleSetData& data, std::uint32_t number, Obstacle obstacle) {
  Slot& slot = data.slots[number];
  slot.obstacle = std::move(obstacle);
  box_obstacle(slot);
  data.put_in(number);
  ++data.size;
}

}  // namespace

ObstacleId ObstacleSet::add(Obstacle obstacle) {
  require_usable(obstacle);
  if (data_->free.empty()) {
    data_->free.push_back(static_cast<std::uint32_t>(data_->slots.size()));
    data_->slots.emplace_back();
  }
  const std::uint32_t number = data_->free.back();
  data_->free.pop_back();
  fill_slot(*data_, number, std::move(obstacle));
  return data_->id_of(number);
}

void ObstacleSet::add_as(ObstacleId id, Obstacle obstacle) {
  require_usable(obstacle);
  constexpr std::uint32_t kMostSlots = 1u << 24;
  const auto number = static_cast<std::uint32_t>(id);
  DYOP_REQUIRE(number < kMostSlots, "id ", static_cast<std::uint64_t>(id),
               " is none that a set gave");
  while (data_->slots.size() <= number) {
    data_->free.push_back(static_cast<std::uint32_t>(data_->slots.size()));
    data_->slots.emplace_back();
  }
  DYOP_REQUIRE(!data_->slots[number].obstacle, "the place of id ", static_cast<std::uint64_t>(id),
               " is taken");
  // From the end, where places that were made for this obstacle are.
  data_->free.erase(std::prev(std::find(data_->free.rbegin(), data_->free.rend(), number).base()));
  data_->slots[number].uses = static_cast<std::uint32_t>(static_cast<std::uint64_t>(id) >> 32);
  fill_slot(*data_, number, std::move(obstacle));
}

ObstacleId ObstacleSet::add(std::shared_ptr<const Shape> shape, const RigidPose& X_WO,
                            std::uint32_t groups) {
  return add({std::move(shape), std::make_shared<RestMotion>(X_WO), groups, false});
}

void ObstacleSet::move(ObstacleId id, const RigidPose& X_WO) {
  move(id, std::make_shared<RestMotion>(X_WO));
}

void ObstacleSet::move(ObstacleId id, std::shared_ptr<const Motion> X_WO) {
  DYOP_REQUIRE(X_WO != nullptr, "an obstacle needs a motion");
  const std::uint32_t number = slot_of(*data_, id);
  data_->take_out(number);
  Slot& slot = data_->slots[number];
  slot.obstacle->X_WO = std::move(X_WO);
  box_obstacle(slot);
  data_->put_in(number);
}

void ObstacleSet::remove(ObstacleId id) {
  const std::uint32_t number = slot_of(*data_, id);
  data_->take_out(number);
  Slot& slot = data_->slots[number];
  slot.obstacle.reset();
  ++slot.uses;
  --data_->size;
  data_->free.push_back(number);
}

bool ObstacleSet::contains(ObstacleId id) const {
  return data_->find(id) != nullptr;
}

const Obstacle& ObstacleSet::obstacle(ObstacleId id) const {
  return *data_->slots[slot_of(*data_, id)].obstacle;
}

std::size_t ObstacleSet::size() const {
  return data_->size;
}

std::vector<ObstacleId> ObstacleSet::ids() const {
  std::vector<ObstacleId> result;
  for (std::uint32_t i = 0; i < data_->slots.size(); ++i) {
    if (data_->slots[i].obstacle) result.push_back(data_->id_of(i));
  }
  std::sort(result.begin(), result.end());
  return result;
}

}  // namespace dyop
