// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/blocked/horizon.h"

#include <algorithm>

namespace dyop::dynamics_internal {
namespace {

// Of the time that is proven: so that a little room is left, and rounding does not use it up.
constexpr Scalar kUsedRoom = 0.9;
constexpr Scalar kShorter = 0.25;

}  // namespace

void Horizon::shorten(const BlockedSubstep& substep) {
  lands_ = substep.must_land;
  only_uses_room_ = !substep.must_land && substep.is_jammed && was_jammed_;
  was_jammed_ = substep.is_jammed;
  if (substep.must_land) {
    tau_ = substep.safe;
  } else if (only_uses_room_) {
    tau_ = kUsedRoom * substep.safe;
  } else {
    const Scalar shorter = kShorter * tau_;
    tau_ = substep.safe > shorter ? std::max(kUsedRoom * substep.safe, shorter) : shorter;
  }
}

}  // namespace dyop::dynamics_internal
