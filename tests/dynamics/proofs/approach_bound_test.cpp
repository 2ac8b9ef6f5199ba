// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "dynamics/step/track.h"
#include "dyop/geometry/primitives.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/random_inputs.h"

namespace dyop::dynamics_internal {
namespace {

using namespace testing;

BodyRecord ball() {
  BodyRecord body;
  body.definition.shape = std::make_shared<Sphere>(1);
  body.radius = 1;
  return body;
}

// By the definition: points of B are followed in the frame of A.
TEST(ApproachBound, BoundsTheWayOfEveryPoint) {
  std::mt19937_64 random(5);
  const BodyRecord body = ball();
  Scalar tightest = 0;
  for (int k = 0; k < 2000; ++k) {
    const Scalar tau = random_magnitude(-3, 0, random);
    const TimeInterval interval{2, 2 + tau};
    const auto move = [&] {
      const CentralState state{random_pose(3, random), Vector3::Zero(), Vector3::Zero()};
      const Twist twist = random_twist(5, k % 3 ? 4 : 0.1, random);
      return twist_move(body, state, interval.begin, twist.v_WB, twist.w_WB);
    };
    const BodyMove a = move();
    const BodyMove b = k % 5 ? move() : rest_move(body, std::make_shared<RestMotion>(RigidPose()));
    const Vector3 pivot_W = random_vector(2, random);
    const NearBound bound = approach_bound(a, b, interval, pivot_W);
    for (int point = 0; point < 5; ++point) {
      const Scalar l = point == 0 ? 0 : random_magnitude(-2, 1, random);
      const Vector3 p_W = pivot_W + l * random_direction(random);
      const Vector3 p_B = b.motion->pose(interval.begin).inverse() * p_W;
      const auto seen = [&](Scalar t) {
        return Vector3(a.motion->pose(t).inverse() * (b.motion->pose(t) * p_B));
      };
      const Vector3 start = seen(interval.begin);
      for (const Scalar part : {0.1, 0.5, 0.9, 1.0}) {
        const Scalar way = (seen(interval.begin + part * tau) - start).norm();
        EXPECT_LE(way, bound.reach + bound.slope * l + 1e-12);
        tightest = std::max(tightest, way / (bound.reach + bound.slope * l));
      }
    }
  }
  EXPECT_GT(tightest, 0.9);
}

// A ball that rolls on the plane through its lowest point: what it touches is at rest.
TEST(ApproachBound, IsOfSecondOrderWhereABallRolls) {
  const BodyRecord body = ball();
  const CentralState state{RigidPose(Vector3(0, 0, 1)), Vector3::Zero(), Vector3::Zero()};
  const BodyMove floor = rest_move(body, std::make_shared<RestMotion>(RigidPose()));
  const BodyMove rolling = twist_move(body, state, 0, {1, 0, 0}, {0, 1, 0});
  for (const Scalar tau : {0.1, 0.01, 0.001}) {
    const TimeInterval interval{0, tau};
    const Vector3 touched = Vector3::Zero();
    const Scalar way =
        (rolling.motion->pose(tau) * (rolling.motion->pose(0).inverse() * touched)).norm();
    EXPECT_LE(way, approach_bound(floor, rolling, interval, touched).reach);
    EXPECT_LE(way, approach_bound(rolling, floor, interval, touched).reach);
    EXPECT_LE(approach_bound(rolling, floor, interval, touched).reach, 2 * tau * tau);
    EXPECT_LE(approach_bound(floor, rolling, interval, touched).reach, 2 * tau * tau);
    EXPECT_NEAR(approach_bound(floor, rolling, interval, touched).slope, tau, 1e-12);
    EXPECT_GT(closing_bound(floor, rolling, interval), tau);
  }
}

}  // namespace
}  // namespace dyop::dynamics_internal
