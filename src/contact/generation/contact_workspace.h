// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact/generation/contact_search.h"
#include "distance/neighbour_list.h"
#include "dyop/contact/contact_generator.h"

namespace dyop {

struct ContactWorkspace::Impl {
  distance_internal::BoxPairStack stack;
  std::vector<contact_internal::FoundContact> found;
  std::vector<char> is_double;
  distance_internal::BoxPairStack first_pairs;
  distance_internal::BoxPairStack split_pairs;
  /// Of the shapes of the next calls, neither a compound; null: none.
  distance_internal::NeighbourList* neighbours = nullptr;
};

namespace contact_internal {

/// While this lives, contacts of the two shapes of a neighbour list are looked for with it.
class UseOfNeighbours {
 public:
  UseOfNeighbours(ContactWorkspace& workspace, NeighbourList& neighbours) : workspace_(workspace) {
    workspace_.impl().neighbours = &neighbours;
  }
  ~UseOfNeighbours() { workspace_.impl().neighbours = nullptr; }
  UseOfNeighbours(const UseOfNeighbours&) = delete;
  UseOfNeighbours& operator=(const UseOfNeighbours&) = delete;

 private:
  ContactWorkspace& workspace_;
};

}  // namespace contact_internal
}  // namespace dyop
