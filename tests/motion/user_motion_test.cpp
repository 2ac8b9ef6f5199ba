// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "dyop/motion/motion.h"
#include "motion/motion_test_tools.h"

namespace dyop::testing {
namespace {

UserMotion::Functions falling() {
  UserMotion::Functions functions;
  functions.pose = [](Scalar t) { return RigidPose(Vector3(0, 0, -5 * t * t)); };
  functions.twist = [](Scalar t) { return Twist{Vector3(0, 0, -10 * t), Vector3::Zero()}; };
  functions.twist_bound = [](const TimeInterval& interval) {
    return TwistBound{10 * std::fmax(std::abs(interval.begin), std::abs(interval.end)), 0, 10, 0};
  };
  return functions;
}

TEST(UserMotion, HandsThroughTheFunctions) {
  const UserMotion motion(falling(), {0, 4});
  EXPECT_EQ(motion.pose(2).translation().z(), -20);
  EXPECT_EQ(motion.twist(2).v_WB.z(), -20);
  EXPECT_EQ(motion.twist_bound({1, 3}).linear_speed, 30);
  EXPECT_EQ(motion.smooth_until(1), 4);
  EXPECT_EQ(UserMotion(falling()).domain().begin, -kInfinity);
}

TEST(UserMotion, RefusesMissingFunctionsAndReversedDomains) {
  UserMotion::Functions functions = falling();
  functions.twist_bound = nullptr;
  EXPECT_EQ(message_of([&] { UserMotion{functions}; }), "user motion needs a twist_bound function");
  EXPECT_EQ(message_of([] {
              UserMotion(falling(), {1, 0});
            }),
            "domain of user motion must not be reversed: begin 1, end 0");
}

TEST(UserMotion, RefusesBoundsThatCannotBeBounds) {
  for (const Scalar wrong : {-1.0, std::nan("")}) {
    UserMotion::Functions functions = falling();
    functions.twist_bound = [=](const TimeInterval&) { return TwistBound{1, 2, wrong, 3}; };
    const UserMotion motion(functions);
    EXPECT_NE(message_of([&] {
                motion.twist_bound({0, 1});
              }).find("linear acceleration"),
              std::string::npos);
  }
}

TEST(UserMotion, RefusesSmoothUntilThatDoesNotAdvance) {
  UserMotion::Functions functions = falling();
  functions.smooth_until = [](Scalar) { return 3.0; };
  const UserMotion motion(functions);
  EXPECT_EQ(motion.smooth_until(2), 3);
  EXPECT_EQ(message_of([&] { motion.smooth_until(3); }),
            "smooth_until of a user motion must be after 3, not 3");
}

}  // namespace
}  // namespace dyop::testing
