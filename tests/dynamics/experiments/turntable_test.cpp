// SPDX-License-Identifier: BSD-3-Clause

// A solid ball that rolls on a turntable: its centre goes round circles at 2/7 of the table's rate,
// wherever it starts.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "dyop/geometry/primitives.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

TEST(Turntable, ABallGoesRoundAtTwoSeventhsOfItsRate) {
  for (const Scalar h : {0.02, 0.005}) {
    for (const Vector3& v : {Vector3(0, 0.5, 0), Vector3(-0.6, 0.2, 0)}) {
      constexpr Scalar kRate = 2;
      constexpr Scalar kRadius = 0.2;
      World world(earth_options());
      BodyDefinition table = floor_body(1);
      table.kind = BodyKind::Kinematic;
      table.motion = std::make_shared<ConstantTwistMotion>(
          table.initial.X_WB, Twist{Vector3::Zero(), Vector3(0, 0, kRate)});
      world.add_body(table);
      const Vector3 start(1, 0, kRadius + rest_gap(kRadius));
      // The ball's lowest point moves with the table.
      const Vector3 table_v = kRate * Vector3(-start.y(), start.x(), 0);
      const Vector3 w = Vector3::UnitZ().cross(v - table_v) / kRadius;
      BodyDefinition ball = dynamic_body("ball", std::make_shared<Sphere>(kRadius), start, v, w);
      ball.friction = 1;
      ball.restitution = 0;
      const BodyId id = world.add_body(ball);
      constexpr Scalar kTime = 5;
      for (int k = 0; k < std::lround(kTime / h); ++k) {
        ASSERT_EQ(world.advance(h).status, AdvanceStatus::Completed);
      }
      // With J at the middle of the gap the ball rolls on a radius that is larger by half of it.
      const Scalar rolling = kRadius + rest_gap(kRadius) / 2;
      const Scalar part = 0.4 * kRadius * kRadius / (rolling * rolling);
      const Scalar rate = kRate * part / (1 + part);
      const Vector3 center = start + Vector3::UnitZ().cross(v) / rate;
      const Vector3 expected =
          center + rotation_from_vector(Vector3(0, 0, rate * kTime)) * (start - center);
      const Scalar radius = (start - center).norm();
      EXPECT_LT((world.state(id).X_WB.translation() - expected).norm(), 1e-3 * radius) << h;
    }
  }
}

// Six rows of cubes that lie on a belt lie as still on it as on a floor.
TEST(Turntable, APyramidDoesNotCreepOnABelt) {
  for (const Scalar speed : {0., 1., 10.}) {
    WorldOptions options = earth_options();
    options.sleep_steps = 0;
    World world(options);
    BodyDefinition belt = floor_body(0.5);
    belt.kind = BodyKind::Kinematic;
    belt.motion = std::make_shared<ConstantTwistMotion>(
        belt.initial.X_WB, Twist{Vector3(speed, 0, 0), Vector3::Zero()});
    world.add_body(belt);
    constexpr Scalar kCube = 0.2;
    constexpr int kRows = 6;
    const Scalar gap = rest_gap(kCube / 2 * std::sqrt(3.));
    std::vector<BodyId> cubes;
    for (int row = 0; row < kRows; ++row) {
      for (int k = 0; k + row < kRows; ++k) {
        BodyDefinition cube =
            dynamic_body("cube " + std::to_string(cubes.size()),
                         std::make_shared<Box>(Vector3::Constant(kCube / 2)),
                         {1.05 * kCube * (k + row / 2.), 0, kCube / 2 + gap + row * (kCube + gap)},
                         {speed, 0, 0});
        cube.restitution = 0;
        cubes.push_back(world.add_body(cube));
      }
    }
    const auto places = [&] {
      std::vector<Vector3> all;
      for (const BodyId id : cubes) {
        all.push_back(world.state(id).X_WB.translation() -
                      world.state(cubes.front()).X_WB.translation());
      }
      return all;
    };
    for (int k = 0; k < 50; ++k) world.advance(0.01);
    const std::vector<Vector3> before = places();
    for (int k = 0; k < 100; ++k) world.advance(0.01);
    const std::vector<Vector3> after = places();
    for (std::size_t i = 0; i < before.size(); ++i) {
      EXPECT_LT((after[i] - before[i]).norm(), 1e-8) << speed << " " << i;
    }
  }
}

}  // namespace
}  // namespace dyop
