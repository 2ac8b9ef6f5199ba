// SPDX-License-Identifier: BSD-3-Clause
#include "contact/solver/body_parts.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace dyop::contact_internal {
namespace {

// Contacts of a part, and the fewest parts that are worth it. Smaller: what lies between them is
// felt, as many more sweeps. Found by measurement on poured spheres and hulls.
constexpr std::size_t kContactsPerPart = 500;
constexpr std::size_t kFewestParts = 3;

// Regions, by phase: the parts; what lies between a part and the next, first of those with even
// numbers; all the rest.
constexpr std::size_t kAfterEven = BodyParts::kMostParts;
constexpr std::size_t kAfterOdd = kAfterEven + BodyParts::kMostParts / 2;
constexpr std::size_t kRest = kAfterOdd + BodyParts::kMostParts / 2 - 1;

std::size_t phase_of(std::size_t region) {
  if (region < kAfterEven) return 0;
  if (region < kAfterOdd) return 1;
  return region < kRest ? 2 : 3;
}

}  // namespace

void BodyParts::cut(const ContactSystem& system) {
  const std::size_t count = system.velocities().size();
  const std::size_t parts = std::min(system.blocks().size() / kContactsPerPart, kMostParts);
  const bool is_cut = parts >= kFewestParts;
  regions_.resize(is_cut ? kRest + 1 : 1);
  for (std::size_t i = 0; i < regions_.size(); ++i) {
    regions_[i].phase = phase_of(i);
    regions_[i].blocks.clear();
  }
  if (is_cut) {
    list_neighbours(system);
    order_bodies();
    assign_parts(parts);
  } else {
    bodies_.resize(count);
    std::iota(bodies_.begin(), bodies_.end(), std::size_t{0});
  }
  for (std::size_t i = 0; i < system.blocks().size(); ++i) {
    regions_[is_cut ? region_of(system.blocks()[i]) : 0].blocks.push_back(i);
  }
}

std::size_t BodyParts::region_of(const Block& block) const {
  if (block.slot_a < 0 || block.slot_b < 0) {
    return part_[std::size_t(std::max(block.slot_a, block.slot_b))];
  }
  const auto [low, high] =
      std::minmax({part_[std::size_t(block.slot_a)], part_[std::size_t(block.slot_b)]});
  if (low == high) return low;
  if (high > low + 1) return kRest;
  return (low % 2 == 0 ? kAfterEven : kAfterOdd) + low / 2;
}

void BodyParts::list_neighbours(const ContactSystem& system) {
  const std::size_t count = system.velocities().size();
  first_.assign(count + 1, 0);
  for (const Block& block : system.blocks()) {
    if (block.slot_a < 0 || block.slot_b < 0) continue;
    ++first_[std::size_t(block.slot_a)];
    ++first_[std::size_t(block.slot_b)];
  }
  std::size_t end = 0;
  for (std::size_t& first : first_) first = end += first;
  neighbours_.resize(end);
  for (const Block& block : system.blocks()) {
    if (block.slot_a < 0 || block.slot_b < 0) continue;
    neighbours_[--first_[std::size_t(block.slot_a)]] = std::size_t(block.slot_b);
    neighbours_[--first_[std::size_t(block.slot_b)]] = std::size_t(block.slot_a);
  }
}

// Appends what hangs together with a body, layer by layer.
void BodyParts::walk(std::size_t start) {
  std::size_t next = bodies_.size();
  bodies_.push_back(start);
  is_reached_[start] = 1;
  for (; next < bodies_.size(); ++next) {
    const std::size_t body = bodies_[next];
    for (std::size_t k = first_[body]; k < first_[body + 1]; ++k) {
      if (std::exchange(is_reached_[neighbours_[k]], 1) == 0) bodies_.push_back(neighbours_[k]);
    }
  }
}

// From the body that is farthest from where a first walk began, so that layers are short.
void BodyParts::order_bodies() {
  const std::size_t count = first_.size() - 1;
  bodies_.clear();
  is_reached_.assign(count, 0);
  for (std::size_t body = 0; body < count; ++body) {
    if (is_reached_[body] != 0) continue;
    const std::size_t begin = bodies_.size();
    walk(body);
    const std::size_t farthest = bodies_.back();
    for (std::size_t k = begin; k < bodies_.size(); ++k) is_reached_[bodies_[k]] = 0;
    bodies_.resize(begin);
    walk(farthest);
  }
}

// With about as many contacts each.
void BodyParts::assign_parts(std::size_t parts) {
  part_.resize(bodies_.size());
  const std::size_t total = neighbours_.size() + bodies_.size();
  std::size_t before = 0;
  for (const std::size_t body : bodies_) {
    part_[body] = before * parts / total;
    before += 1 + first_[body + 1] - first_[body];
  }
}

}  // namespace dyop::contact_internal
