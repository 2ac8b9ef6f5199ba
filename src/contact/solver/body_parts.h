// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "contact/solver/contact_system.h"

namespace dyop::contact_internal {

// Cuts a system of contacts into regions that can be swept one beside the other: parts of its
// bodies, and what lies between two of them. Bodies are taken layer by layer, each the neighbours
// of the one before, so that as a rule parts touch only the next.
class BodyParts {
 public:
  static constexpr std::size_t kMostParts = 8;

  // Regions of one phase share no body that can be moved; phases follow one another.
  static constexpr std::size_t kPhases = 4;

  struct Region {
    std::size_t phase = 0;
    std::vector<std::size_t> blocks;  // in their order
  };

  // One region of everything if there are few contacts.
  void cut(const ContactSystem& system);

  // By phase, and those of a phase in their order.
  const std::vector<Region>& regions() const { return regions_; }
  // The bodies, part after part.
  const std::vector<std::size_t>& bodies() const { return bodies_; }

 private:
  void list_neighbours(const ContactSystem& system);
  void walk(std::size_t start);
  void order_bodies();
  void assign_parts(std::size_t parts);
  std::size_t region_of(const Block& block) const;

  std::vector<std::size_t> first_, neighbours_;  // by body
  std::vector<std::size_t> bodies_;
  std::vector<std::size_t> part_;  // by body
  std::vector<char> is_reached_;   // by body
  std::vector<Region> regions_;
};

}  // namespace dyop::contact_internal
