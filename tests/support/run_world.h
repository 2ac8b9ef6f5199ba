// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "dyop/dynamics/world.h"

namespace dyop::testing {

/// About this time in steps of h, each completed without a stall, and if asked for with all its
/// contacts and joints solved.
inline void run_steps(World& world, Scalar time, Scalar h, bool must_be_solved) {
  const int steps = static_cast<int>(std::lround(time / h));
  for (int k = 0; k < steps; ++k) {
    const AdvanceReport report = world.advance(h);
    ASSERT_EQ(report.status, AdvanceStatus::Completed);
    ASSERT_EQ(report.work.stalls, 0);
    if (must_be_solved) {
      ASSERT_EQ(report.work.unconverged, 0);
    }
  }
}

inline void run_for(World& world, Scalar time, Scalar h = 0.01) {
  run_steps(world, time, h, false);
}

inline void run_solved(World& world, Scalar time, Scalar h = 0.01) {
  run_steps(world, time, h, true);
}

}  // namespace dyop::testing
