// SPDX-License-Identifier: BSD-3-Clause
#include "haptics/escape.h"

namespace dyop::haptics_internal {

void Escape::start(std::size_t pair, Scalar first_length) {
  *this = {};
  pair_ = pair;
  first_length_ = length_ = first_length;
}

// The neighbours of the centre cell of a 3 x 3 x 3 cube: all but number 13.
Vector3 Escape::direction_of(int number) {
  const int cell = number < kDirections / 2 ? number : number + 1;
  return Vector3(cell % 3 - 1, cell / 3 % 3 - 1, cell / 9 - 1).normalized();
}

std::optional<Vector3> Escape::direction() const {
  if (!pair_ || !is_through() || has_failed()) return std::nullopt;
  return direction_of(best_);
}

}  // namespace dyop::haptics_internal
