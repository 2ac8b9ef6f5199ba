// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "contact/generation/contact_search.h"
#include "distance/neighbour_list.h"
#include "dyop/contact/contact_generator.h"

namespace dyop {

struct ContactWorkspace::Impl {
  internal::BoxPairStack stack;
  std::vector<internal::FoundContact> found;
  std::vector<char> is_double;
  internal::BoxPairStack first_pairs;
  /// Of the shapes of the next calls, neither a compound; null: none.
  const internal::NeighbourList* neighbours = nullptr;
  std::optional<internal::ContactRegion> region_W;
};

namespace internal {

/// While this lives, contacts of the two shapes of a neighbour list are looked for with it, and only
/// those whose points on A may be in a region of the world.
class UseOfNeighbours {
 public:
  UseOfNeighbours(ContactWorkspace& workspace, const NeighbourList& neighbours,
                  const std::optional<ContactRegion>& region_W = std::nullopt)
      : workspace_(workspace) {
    workspace_.impl().neighbours = &neighbours;
    workspace_.impl().region_W = region_W;
  }
  ~UseOfNeighbours() {
    workspace_.impl().neighbours = nullptr;
    workspace_.impl().region_W.reset();
  }
  UseOfNeighbours(const UseOfNeighbours&) = delete;
  UseOfNeighbours& operator=(const UseOfNeighbours&) = delete;

 private:
  ContactWorkspace& workspace_;
};

}  // namespace internal
}  // namespace dyop
