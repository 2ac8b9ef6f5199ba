// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <ostream>

#include "dyop/core/export.h"

namespace DYOP_EXPORT dyop {

/// Identifies a body of one World. A slot is reused after its body was removed, with a new
/// generation: an id that outlived its body is refused, never mistaken for a newer body.
struct BodyId {
  std::uint32_t slot = ~std::uint32_t{0};
  std::uint32_t generation = 0;

  BodyId() = default;  ///< refers to no body
  constexpr explicit BodyId(std::size_t the_slot, std::uint32_t the_generation = 0)
      : slot(static_cast<std::uint32_t>(the_slot)), generation(the_generation) {}

  friend auto operator<=>(const BodyId&, const BodyId&) = default;
  friend std::ostream& operator<<(std::ostream& out, const BodyId& id) {
    out << id.slot;
    if (id.generation > 0) out << '.' << id.generation;
    return out;
  }
};

}  // namespace dyop

template <>
struct std::hash<dyop::BodyId> {
  std::size_t operator()(const dyop::BodyId& id) const noexcept {
    return std::hash<std::uint64_t>{}(std::uint64_t{id.generation} << 32 | id.slot);
  }
};
