// SPDX-License-Identifier: BSD-3-Clause

// Bodies that roll, rock or slide on fine facets do what those on the smooth surface do, at several
// turns about the vertical.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "support/inputs/curved_meshes.h"
#include "support/inputs/rolling_scenes.h"
#include "support/inputs/world_scenes.h"
#include "support/world_energy.h"

namespace dyop {
namespace {

using namespace testing;

constexpr Scalar kPi = std::numbers::pi;

RigidPose turned_about_z(Scalar azimuth) {
  return RigidPose(rotation_from_vector(Vector3(0, 0, azimuth)), Vector3::Zero());
}

// The time that passes between the first and the third zero of `angle`, a function of the World:
// one period.
template <typename Angle>
Scalar period(World& world, Scalar h, Scalar longest, const Angle& angle) {
  Scalar last = angle(world);
  std::vector<Scalar> zeros;
  for (int k = 0; k < std::lround(longest / h) && zeros.size() < 3; ++k) {
    world.advance(h);
    const Scalar next = angle(world);
    if ((last < 0) != (next < 0)) zeros.push_back(world.time() - h * next / (next - last));
    last = next;
  }
  return zeros.size() == 3 ? zeros[2] - zeros[0] : 0;
}

// Period of x with inertia(x) x'^2 / 2 + potential(x) constant and even, from rest at `most`.
template <typename Inertia, typename Potential>
Scalar exact_period(Scalar most, const Inertia& inertia, const Potential& potential) {
  constexpr int kParts = 2000;
  Scalar sum = 0;
  for (int k = 0; k < kParts; ++k) {
    const Scalar phase = (k + 0.5) * kPi / 2 / kParts;
    const Scalar x = most * std::sin(phase);
    const Scalar speed = std::sqrt(2 * (potential(most) - potential(x)) / inertia(x));
    sum += most * std::cos(phase) / speed * kPi / 2 / kParts;
  }
  return 4 * sum;
}

struct Swing {
  Scalar period = 0;
  Scalar exact = 0;
  Scalar energy_error = 0;  // after it, relative to the energy of the swing
};

// A ball of radius 0.25 in a trough or bowl of radius 1.
Swing ball_swing(const MeshArrays& support, Scalar friction, Scalar azimuth, Scalar h) {
  constexpr Scalar kRadius = 0.25;
  constexpr Scalar kAngle = 0.3;
  World world(earth_options());
  BodyDefinition fixed = floor_body(friction);
  fixed.shape = std::make_shared<TriangleMesh>(support.mesh());
  fixed.initial.X_WB = turned_about_z(azimuth);
  world.add_body(fixed);
  const Scalar length = 1 - kRadius - rest_gap(kRadius);
  BodyDefinition ball = dynamic_body(
      "ball", std::make_shared<Sphere>(kRadius),
      turned_about_z(azimuth) * Vector3(length * std::sin(kAngle), 0, -length * std::cos(kAngle)));
  ball.friction = friction;
  ball.restitution = 0;
  const BodyId id = world.add_body(ball);
  const Scalar before = energy(world, Vector3(0, 0, -kGravity));
  const Vector3 along(std::cos(azimuth), std::sin(azimuth), 0);
  Swing swing;
  swing.period = period(world, h, 5, [&](const World& now) {
    const Vector3 p = now.state(id).X_WB.translation();
    return std::atan2(along.dot(p), -p.z());
  });
  // A rolling ball has 7/5 of the inertia of a sliding one.
  const Scalar inertia = (friction > 0 ? 1.4 : 1) * length * length;
  swing.exact = exact_period(
      kAngle, [&](Scalar) { return inertia; },
      [&](Scalar x) { return -kGravity * length * std::cos(x); });
  const Scalar depth = ball.mass_properties.mass * kGravity * length * (1 - std::cos(kAngle));
  swing.energy_error = (energy(world, Vector3(0, 0, -kGravity)) - before) / depth;
  return swing;
}

TEST(WorldFacets, ABallInATroughHasTheExactPeriod) {
  const MeshArrays support = trough(1, 0.5, 0.5, 2048);
  for (const Scalar friction : {0.0, 1.0}) {
    for (const Scalar azimuth : {0.0, 0.6}) {
      const Swing swing = ball_swing(support, friction, azimuth, 0.01);
      EXPECT_NEAR(swing.period, swing.exact, 1e-3 * swing.exact) << friction << ' ' << azimuth;
      EXPECT_LT(std::abs(swing.energy_error), 1e-3) << friction << ' ' << azimuth;
    }
  }
}

TEST(WorldFacets, ABallInABowlHasTheExactPeriod) {
  const MeshArrays support = bowl(1, 0.4, 30);
  for (const Scalar friction : {0.0, 1.0}) {
    for (const Scalar azimuth : {0.0, 0.4}) {
      const Swing swing = ball_swing(support, friction, azimuth, 0.01);
      EXPECT_NEAR(swing.period, swing.exact, 5e-3 * swing.exact) << friction << ' ' << azimuth;
      EXPECT_LT(std::abs(swing.energy_error), 1e-2) << friction << ' ' << azimuth;
    }
  }
}

// Its rim acts as a round one.
TEST(WorldFacets, AFineDiscRollsOn) {
  const auto shape = std::make_shared<TriangleMesh>(disc(1, 0.25, 2048).mesh());
  for (const Scalar azimuth : {0.0, 0.6}) {
    for (const Scalar h : {0.01, 0.005}) {
      const Vector3 along(std::cos(azimuth), std::sin(azimuth), 0);
      World world(earth_options());
      world.add_body(floor_body(1));
      BodyDefinition body =
          dynamic_body("disc", shape, {0, 0, 1 + rest_gap(shape->bounding_radius())}, along,
                       Vector3::UnitZ().cross(along));
      body.initial.X_WB = turned_about_z(azimuth) * body.initial.X_WB;
      body.friction = 1;
      body.restitution = 0;
      const BodyId id = world.add_body(body);
      const Scalar before = world.kinetic_energy();
      for (int k = 0; k < std::lround(1 / h); ++k) world.advance(h);
      EXPECT_NEAR(world.kinetic_energy(), before, 5e-3 * before) << azimuth << ' ' << h;
      EXPECT_NEAR(along.dot(world.state(id).X_WB.translation()), 1, 5e-3) << azimuth << ' ' << h;
    }
  }
}

// Largest errors of the energy over the kinetic energy, whatever the facets: those of the step
// alone, and a quarter at half the step. The coin's contact goes round its rim by a tenth of the
// radius in a step of 0.01, with a rim that hardly turns; the half disc and the oloid start from
// rest.
TEST(WorldFacets, RoundMeshesKeepTheirEnergyToSecondOrder) {
  struct Case {
    const char* scene;
    int facets;
    Scalar most;  // at h = 0.02
  };
  const Case cases[] = {{"coin", 512, 8e-4},
                        {"coin", 2048, 8e-4},
                        {"half-disc", 512, 8e-4},
                        {"half-disc", 2048, 8e-4},
                        {"oloid", 4096, 2e-4}};
  for (const Case& c : cases) {
    for (const Scalar azimuth : {0.0, 0.6}) {
      Scalar most = c.most;
      for (const Scalar h : {0.02, 0.01, 0.005}) {
        EXPECT_LT(rolling_energy_error(c.scene, c.facets, azimuth, h, 0.5), most)
            << c.scene << ' ' << c.facets << ' ' << azimuth << ' ' << h;
        most /= 4;
      }
    }
  }
}

// A disc of so fine facets rolls as a round one however short the step is; one of 128 is a polygon,
// which loses 2/3 of a facet's angle of its energy per facet, and more at first order in the step.
TEST(WorldFacets, ADiscRollsOnUnlessItIsAPolygon) {
  for (const Scalar h : {0.01, 0.0025, 0.000625}) {
    EXPECT_LT(rolling_energy_error("disc", 512, 0, h, 0.1), 1e-6) << h;
  }
  const Scalar exact = 2 * kPi / 128 * 2 / 3 * 0.5;  // turns by half a radian
  const Scalar coarse = rolling_energy_error("disc", 128, 0, 0.0025, 0.5) / exact;
  const Scalar fine = rolling_energy_error("disc", 128, 0, 0.000625, 0.5) / exact;
  EXPECT_GT(fine, 0.9);
  EXPECT_LT(fine, 1.4);
  EXPECT_GT(coarse, fine);
}

// A ball on a mesh whose vertices lie on a sphere.
TEST(WorldFacets, ABallInABowlKeepsItsEnergyToSecondOrder) {
  Scalar most = 1e-3;
  for (const Scalar h : {0.02, 0.01}) {
    EXPECT_LT(rolling_energy_error("bowl", 120, 0.6, h, 0.3), most) << h;
    most /= 4;
  }
}

// Rolling on its arc, as a pendulum: the centre of mass is e = 4 r / (3 pi) below the axis, and its
// moment about the point of contact I + m (r^2 + e^2 - 2 r e cos(x)).
TEST(WorldFacets, AHalfDiscRocksWithTheExactPeriod) {
  const auto shape = std::make_shared<TriangleMesh>(half_disc(1, 0.25, 512).mesh());
  for (const Scalar azimuth : {0.0, 0.6}) {
    constexpr Scalar kAngle = 0.3;
    World world(earth_options());
    world.add_body(floor_body(1));
    BodyDefinition body =
        dynamic_body("half disc", shape, {0, 0, 1 + rest_gap(shape->bounding_radius())});
    body.initial.X_WB =
        turned_about_z(azimuth) *
        RigidPose(rotation_from_vector(Vector3(0, kAngle, 0)), body.initial.X_WB.translation());
    body.friction = 1;
    body.restitution = 0;
    const BodyId id = world.add_body(body);
    const Scalar e = 4 / (3 * kPi);
    const Scalar exact = exact_period(
        kAngle, [&](Scalar x) { return 0.5 - e * e + 1 + e * e - 2 * e * std::cos(x); },
        [&](Scalar x) { return -kGravity * e * std::cos(x); });
    const Vector3 axis(-std::sin(azimuth), std::cos(azimuth), 0);
    const Scalar found = period(world, 0.01, 5, [&](const World& now) {
      return axis.dot(rotation_vector(now.state(id).X_WB.rotation() *
                                      turned_about_z(azimuth).rotation().transpose()));
    });
    EXPECT_NEAR(found, exact, 5e-3 * exact) << azimuth;
  }
}

// A block that slides along the inside of a polygon meets the next facet in most steps: another
// contact than the one it slides on, however small the angle, so one round answers it.
TEST(WorldFacets, SlidingIntoTheNextFacetTakesOneRound) {
  constexpr int kSteps = 20;
  World world(earth_options());
  BodyDefinition fixed = floor_body(0);
  fixed.shape = std::make_shared<TriangleMesh>(trough(1, 1, kPi / 2, 16).mesh());
  world.add_body(fixed);
  BodyDefinition block = dynamic_body("block", std::make_shared<Box>(Vector3(0.15, 0.3, 0.05)),
                                      Vector3(0.1, 0, 0.07 - std::cos(kPi / 32)));
  block.friction = 0;
  block.restitution = 0;
  block.initial.twist.v_WB = Vector3(8, 0, 0);
  world.add_body(block);
  std::int64_t rounds = 0;
  for (int k = 0; k < kSteps; ++k) {
    const AdvanceReport report = world.advance(0.01);
    ASSERT_EQ(report.status, AdvanceStatus::Completed) << k;
    rounds += report.work.rounds;
  }
  EXPECT_GT(rounds, 0);
  EXPECT_LE(rounds, kSteps);
}

}  // namespace
}  // namespace dyop
