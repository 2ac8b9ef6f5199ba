// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/blocked/horizon.h"

#include <algorithm>

namespace dyop::internal {
namespace {

// Of the time that is proven: so that a little room is left, and rounding does not use it up.
constexpr Scalar kUsedRoom = 0.9;
constexpr Scalar kShorter = 0.25;

}  // namespace

void Horizon::shorten(const BlockedLeg& leg) {
  lands_ = leg.must_land;
  only_uses_room_ = !leg.must_land && leg.is_jammed && was_jammed_;
  was_jammed_ = leg.is_jammed;
  if (leg.must_land) {
    tau_ = leg.safe;
  } else if (only_uses_room_) {
    tau_ = kUsedRoom * leg.safe;
  } else {
    const Scalar shorter = kShorter * tau_;
    tau_ = leg.safe > shorter ? std::max(kUsedRoom * leg.safe, shorter) : shorter;
  }
}

}  // namespace dyop::internal
