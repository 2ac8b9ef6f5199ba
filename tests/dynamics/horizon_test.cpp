// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "dynamics/step/substep.h"

namespace dyop {
namespace {

using dynamics_internal::BlockedSubstep;
using dynamics_internal::Horizon;

TEST(Horizon, StaysWithinWhatIsProvenOrFallsToAQuarter) {
  for (const Scalar safe : {0.0, 0.1, 0.2, 0.251, 0.3, 0.5, 0.99}) {
    SCOPED_TRACE(safe);
    Horizon horizon(1);
    horizon.shorten(BlockedSubstep{.safe = safe});
    EXPECT_FALSE(horizon.lands());
    EXPECT_FALSE(horizon.only_uses_room());
    if (safe > 0.25) {
      EXPECT_LT(horizon.tau(), safe);
      EXPECT_GE(horizon.tau(), 0.25);
      EXPECT_GE(horizon.tau(), 0.8 * safe);
    } else {
      EXPECT_EQ(horizon.tau(), 0.25);
    }
  }
}

TEST(Horizon, EndsAtAHitThatMustBeResolvedThere) {
  Horizon horizon(1);
  horizon.shorten({.safe = 0.125, .must_land = true});
  EXPECT_TRUE(horizon.lands());
  EXPECT_EQ(horizon.tau(), 0.125);
  horizon.shorten({.safe = 0});
  EXPECT_FALSE(horizon.lands());
}

// The first one may be infeasible by its length; only the second in a row tells that no length
// helps.
TEST(Horizon, UsesTheRoomThatIsLeftAfterTwoJamsInARow) {
  Horizon horizon(1);
  horizon.shorten({.safe = 0.01, .is_infeasible = true});
  EXPECT_FALSE(horizon.only_uses_room());
  EXPECT_EQ(horizon.tau(), 0.25);
  horizon.shorten({.safe = 0.01});
  horizon.shorten({.safe = 0.01, .is_infeasible = true});
  EXPECT_FALSE(horizon.only_uses_room());
  horizon.shorten({.safe = 0.01, .is_infeasible = true});
  EXPECT_TRUE(horizon.only_uses_room());
  EXPECT_LT(horizon.tau(), 0.01);
  EXPECT_GT(horizon.tau(), 0.005);
  horizon.shorten({.safe = 0.001, .must_land = true, .is_infeasible = true});
  EXPECT_FALSE(horizon.only_uses_room());
  EXPECT_TRUE(horizon.lands());
}

}  // namespace
}  // namespace dyop
