// SPDX-License-Identifier: BSD-3-Clause

// Plates that slide and spin on a floor, whose friction couples the two: against the equations of a
// body on four corners that share the load as springs would, integrated in steps of their own.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

struct Puck {
  Vector3 half_extents;
  Scalar friction;
  Scalar direction;  // of the velocity, about the normal
  Scalar speed;
  Scalar spin;
};

// Place, turn, velocity and spin.
using PuckState = Eigen::Matrix<Scalar, 6, 1>;

PuckState puck_rate(const Puck& puck, Scalar mass, Scalar inertia, const PuckState& s) {
  std::array<Eigen::Vector2d, 4> places;
  std::array<Eigen::Vector2d, 4> pulls;  // of friction, per load
  Matrix3 balance = Matrix3::Zero();     // of weight and of torque about both axes in the plane
  const Scalar height = puck.half_extents.z();
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector3 corner(k % 2 == 0 ? puck.half_extents.x() : -puck.half_extents.x(),
                         k / 2 == 0 ? puck.half_extents.y() : -puck.half_extents.y(), 0);
    places[k] = Eigen::Rotation2D<Scalar>(s[2]) * corner.head<2>();
    const Eigen::Vector2d u =
        s.segment<2>(3) + s[5] * Eigen::Vector2d(-places[k].y(), places[k].x());
    pulls[k] = -puck.friction * u / std::max(u.norm(), Scalar{1e-12});
    const Vector3 affine(1, places[k].x(), places[k].y());
    balance.row(0) += affine;
    balance.row(1) += affine * (places[k].y() + height * pulls[k].y());
    balance.row(2) += affine * (places[k].x() + height * pulls[k].x());
  }
  const Vector3 loads = balance.inverse() * Vector3(mass * kGravity, 0, 0);
  PuckState rate;
  rate << s[3], s[4], s[5], 0, 0, 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector2d force = loads.dot(Vector3(1, places[k].x(), places[k].y())) * pulls[k];
    rate.segment<2>(3) += force / mass;
    rate[5] += (places[k].x() * force.y() - places[k].y() * force.x()) / inertia;
  }
  return rate;
}

// Where it stops: classical Runge-Kutta.
PuckState puck_at_rest(const Puck& puck, const MassProperties& properties) {
  const Scalar mass = properties.mass;
  const Scalar inertia = properties.I_BBcm(2, 2);
  PuckState s;
  s << 0, 0, 0, puck.speed * std::cos(puck.direction), puck.speed * std::sin(puck.direction),
      puck.spin;
  constexpr Scalar kDt = 5e-4;
  for (int step = 0; step < 10'000 && s.segment<2>(3).norm() > 5e-3; ++step) {
    const PuckState k1 = puck_rate(puck, mass, inertia, s);
    const PuckState k2 = puck_rate(puck, mass, inertia, s + kDt / 2 * k1);
    const PuckState k3 = puck_rate(puck, mass, inertia, s + kDt / 2 * k2);
    const PuckState k4 = puck_rate(puck, mass, inertia, s + kDt * k3);
    s += kDt / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  return s;
}

void expect_stop(const Puck& puck, Scalar h) {
  World world(earth_options());
  world.add_body(floor_body(puck.friction));
  const auto shape = std::make_shared<Box>(puck.half_extents);
  BodyDefinition body = dynamic_body(
      "puck", shape, {0, 0, puck.half_extents.z() + rest_gap(shape->bounding_radius())},
      puck.speed * Vector3(std::cos(puck.direction), std::sin(puck.direction), 0),
      {0, 0, puck.spin});
  body.friction = puck.friction;
  body.restitution = 0;
  const BodyId id = world.add_body(body);
  for (int k = 0; k < 2 / h && !world.is_asleep(id); ++k) {
    ASSERT_EQ(world.advance(h).status, AdvanceStatus::Completed);
  }
  const PuckState expected = puck_at_rest(puck, body.mass_properties);
  const RigidPose X_WB = world.state(id).X_WB;
  const Scalar turn = std::atan2(X_WB.rotation()(1, 0), X_WB.rotation()(0, 0));
  EXPECT_LT((X_WB.translation().head<2>() - expected.head<2>()).norm(),
            2e-3 * expected.head<2>().norm())
      << h;
  EXPECT_NEAR(turn, expected[2], 6e-3) << h;
  EXPECT_TRUE(world.is_asleep(id));
}

// In short steps all the load had drifted to two corners across: 4 % off, and 13 degrees.
TEST(Puck, StopsWhereFourEvenlyLoadedCornersDo) {
  for (const Scalar h : {0.01, 0.00125}) {
    expect_stop({Vector3(0.5, 0.5, 0.1), 0.3, 0.3, 2, 4}, h);
    expect_stop({Vector3(0.5, 0.2, 0.1), 0.3, 1.2, 2, 4}, h);
    expect_stop({Vector3(0.5, 0.5, 0.02), 0.3, 0, 2, 4}, h);
  }
}

}  // namespace
}  // namespace dyop
