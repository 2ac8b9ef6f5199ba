// SPDX-License-Identifier: BSD-3-Clause
#include "toi/rigid/straight_impact.h"

#include <gtest/gtest.h>

#include <chrono>
#include <optional>

#include "dyop/geometry/half_space.h"
#include "dyop/geometry/primitives.h"
#include "dyop/motion/steady_motions.h"

namespace dyop::toi_internal {
namespace {

constexpr Scalar kTolerance = 1e-6;

std::optional<ToiResult> in_closed_form(const Shape& a, const Motion& X_WA, const Shape& b,
                                        const Motion& X_WB, const TimeInterval& interval,
                                        ToiOptions options = {}) {
  options.distance_tolerance = kTolerance;
  const ImpactBand band(options.target_distance, kTolerance);
  ToiResult result;
  if (!are_balls_or_plane(a, b)) return std::nullopt;
  if (!straight_impact({a, X_WA, b, X_WB, interval, options, band}, result)) return std::nullopt;
  return result;
}

// Centres 5 apart, radii 1 and 2, closing speed 2: they touch at t = 1.
TEST(StraightImpact, BracketsTheImpactOfTwoBallsThatSpin) {
  const ConstantTwistMotion flight(RigidPose(Vector3(5, 0, 0)), {{-2, 0, 0}, {0, 0, 40}});
  const auto result = in_closed_form(Sphere(1), RestMotion(), Sphere(2), flight, {0, 3});
  ASSERT_TRUE(result);
  EXPECT_EQ(result->status, ToiStatus::Impact);
  const Scalar middle = 1 - kTolerance / 4;  // half the tolerance apart, at speed 2
  EXPECT_LE(result->t_safe, middle);
  EXPECT_GE(result->t_hit.value(), middle);
  EXPECT_LE(*result->t_hit - result->t_safe, 2 * result->rounding_allowance);
  EXPECT_EQ(result->contact->closing_speed, 2);
  EXPECT_NEAR(result->contact->p_WCa.x(), 1, kTolerance);
}

TEST(StraightImpact, IsForMotionsOfConstantVelocityOnly) {
  const RigidPose X_WB(Vector3(5, 0, 0));
  const ScrewMotion turning(X_WB, {.axis_W = Vector3::UnitZ(), .turn_rate = 1});
  EXPECT_FALSE(in_closed_form(Sphere(1), RestMotion(), Sphere(2), turning, {0, 3}));
  EXPECT_FALSE(
      in_closed_form(HalfSpace(Vector3::UnitX()), RestMotion(), Sphere(2), turning, {0, 3}));
  const ConstantTwistMotion swinging(RigidPose(), {{1, 0, 0}, {0, 0, 1}});
  EXPECT_FALSE(
      in_closed_form(HalfSpace(Vector3::UnitX()), swinging, Sphere(2), RestMotion(X_WB), {0, 3}));
  EXPECT_FALSE(in_closed_form(Box({1, 1, 1}), RestMotion(), Sphere(2), RestMotion(X_WB), {0, 3}));
}

TEST(StraightImpact, LeavesContactAtTheStartToTheSearch) {
  const ConstantTwistMotion flight(RigidPose(Vector3(3, 0, 0)), {{-2, 0, 0}, {}});
  EXPECT_FALSE(in_closed_form(Sphere(1), RestMotion(), Sphere(2), flight, {0, 3}));
  const ConstantTwistMotion leaving(RigidPose(Vector3(3, 0, 0)), {{2, 0, 0}, {}});
  EXPECT_FALSE(in_closed_form(Sphere(1), RestMotion(), Sphere(2), leaving, {0, 3}));
}

TEST(StraightImpact, LeavesADeadlineAndAListOfContactsToTheSearch) {
  const ConstantTwistMotion flight(RigidPose(Vector3(5, 0, 0)), {{-2, 0, 0}, {}});
  ToiOptions options;
  options.with_contacts = true;
  EXPECT_FALSE(in_closed_form(Sphere(1), RestMotion(), Sphere(2), flight, {0, 3}, options));
  options.with_contacts = false;
  options.deadline = std::chrono::steady_clock::time_point::max();
  EXPECT_FALSE(in_closed_form(Sphere(1), RestMotion(), Sphere(2), flight, {0, 3}, options));
}

TEST(StraightImpact, EndsWhatAWorkspaceCouldResume) {
  ToiWorkspace workspace;
  const RestMotion rest;
  const ConstantTwistMotion flight(RigidPose(Vector3(5, 0, 0)), {{-2, 0, 0}, {0, 1, 0}});
  const Box box({1, 1, 1});
  ToiOptions options;
  options.max_node_pairs = 1;
  const ToiResult first = time_of_impact(box, rest, box, flight, {0, 3}, options, workspace);
  ASSERT_EQ(first.status, ToiStatus::BudgetExhausted);
  ASSERT_TRUE(workspace.can_resume());
  const ToiResult second =
      time_of_impact(Sphere(1), rest, Sphere(2), flight, {0, 3}, options, workspace);
  EXPECT_EQ(second.status, ToiStatus::Impact);
  EXPECT_FALSE(workspace.can_resume());
}

}  // namespace
}  // namespace dyop::toi_internal
