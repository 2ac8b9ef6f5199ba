// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include "dyop/toi/time_of_impact.h"

namespace dyop::testing {

/// The time of impact of A and B, having checked that B and A give the same, mirrored.
inline ToiResult both_orders(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                             const TimeInterval& interval, const ToiOptions& options = {}) {
  const ToiResult ab = time_of_impact(a, X_WA, b, X_WB, interval, options);
  const ToiResult ba = time_of_impact(b, X_WB, a, X_WA, interval, options);
  EXPECT_EQ(ab.status, ba.status);
  EXPECT_NEAR(ab.t_safe, ba.t_safe, 1e-5 * (1 + std::abs(ab.t_safe)));
  if (ab.status == ToiStatus::Impact && ba.status == ToiStatus::Impact) {
    EXPECT_LT((ab.contact->nhat_AB_W + ba.contact->nhat_AB_W).norm(), 1e-4);
  }
  return ab;
}

}  // namespace dyop::testing
