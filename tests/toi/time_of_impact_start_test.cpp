// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/both_orders.h"
#include "support/inputs/bodies.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using testing::at;
using testing::both_orders;
using testing::moving;

// Two triangles on A and two points of B beside them, within their boxes: so both pairs are
// measured at the start. The gaps are `gap` and 0.15, closing at speed 1.
class AtTheStart : public ::testing::TestWithParam<int> {
 protected:
  AtTheStart() : falling_(moving(RigidPose(), {0, 1, 0}, {0, 0, 0})) {
    options_.distance_tolerance = 0.25;
  }

  TriangleMesh triangles() const {
    return TriangleMesh({{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {100, 0, 0}, {104, 0, 0}, {100, 4, 0}},
                        {{0, 1, 2}, {3, 4, 5}});
  }
  // The parameter is the place of the pair with that gap.
  TriangleMesh points(Scalar gap) const {
    const bool is_first = GetParam() == 0;
    return TriangleMesh({{1.5, is_first ? -gap : -0.15, 0}, {101.5, is_first ? -0.15 : -gap, 0}},
                        {{0, 0, 0}, {1, 1, 1}});
  }

  // One node pair at a time.
  ToiResult resumed(const TriangleMesh& a, const TriangleMesh& b) const {
    ToiOptions options = options_;
    options.max_node_pairs = 1;
    ToiWorkspace workspace;
    ToiResult result = time_of_impact(a, rest_, b, falling_, {0, 1}, options, workspace);
    for (int k = 0; k < 20 && workspace.can_resume(); ++k) {
      result = resume_time_of_impact(a, rest_, b, falling_, {0, 1}, options, workspace);
    }
    return result;
  }

  RestMotion rest_;
  ConstantTwistMotion falling_;
  ToiOptions options_;
};

// With a tolerance of 0.25, 0.15 is near enough for an impact, and 0.01 is nearer than 0.0625:
// nothing can be guaranteed, whichever pair is examined first.
TEST_P(AtTheStart, OnePairThatIsTooCloseDecides) {
  const TriangleMesh a = triangles();
  const TriangleMesh b = points(0.01);
  const ToiResult result = both_orders(a, rest_, b, falling_, {0, 1}, options_);
  EXPECT_EQ(result.status, ToiStatus::InitiallyWithinTarget);
  EXPECT_NEAR(result.contact->upper, 0.01, 1e-9);
  EXPECT_EQ(resumed(a, b).status, ToiStatus::InitiallyWithinTarget);
}

// So it does if the other pair crosses.
TEST_P(AtTheStart, OnePairThatCrossesDecides) {
  const TriangleMesh a = triangles();
  const Scalar x = GetParam() == 0 ? 0 : 100;  // of the triangle that is crossed
  const TriangleMesh b(
      {{101.5 - x, -0.15, 0}, {1.5 + x, 0.5, -1}, {1.6 + x, 0.5, 1}, {1.5 + x, 1, 1}},
      {{0, 0, 0}, {1, 2, 3}});
  const ToiResult result = both_orders(a, rest_, b, falling_, {0, 1}, options_);
  EXPECT_EQ(result.status, ToiStatus::InitiallyWithinTarget);
  EXPECT_EQ(resumed(a, b).status, ToiStatus::InitiallyWithinTarget);
}

// 0.155 is no closer: an impact, also if the query is resumed while it waits for the other pair.
TEST_P(AtTheStart, AnImpactIsReportedOnceNoPairIsTooClose) {
  const TriangleMesh a = triangles();
  const TriangleMesh b = points(0.155);
  const ToiResult result = both_orders(a, rest_, b, falling_, {0, 1}, options_);
  ASSERT_EQ(result.status, ToiStatus::Impact);
  EXPECT_EQ(result.t_safe, 0);
  EXPECT_TRUE(result.t_hit.has_value());
  const ToiResult other = resumed(a, b);
  ASSERT_EQ(other.status, ToiStatus::Impact);
  EXPECT_EQ(other.t_hit, result.t_hit);
  EXPECT_EQ(other.contact->p_WCb, result.contact->p_WCb);
}

// A third pair that is far away is examined only later.
TEST_P(AtTheStart, AnImpactDoesNotWaitForPairsOfLaterTimes) {
  const TriangleMesh a = triangles();
  const TriangleMesh b({{1.5, -0.15, 0}, {101.5, -0.4, 0}}, {{0, 0, 0}, {1, 1, 1}});
  const ToiResult result = both_orders(a, rest_, b, falling_, {0, 1}, options_);
  EXPECT_EQ(result.status, ToiStatus::Impact);
  EXPECT_EQ(result.t_safe, 0);
}

INSTANTIATE_TEST_SUITE_P(EitherPair, AtTheStart, ::testing::Values(0, 1));

}  // namespace
}  // namespace dyop
