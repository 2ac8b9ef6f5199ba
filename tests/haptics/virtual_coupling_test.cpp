// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/haptics/virtual_coupling.h"

#include <gtest/gtest.h>

#include "dyop/core/error.h"
#include "support/message_of.h"

namespace dyop {
namespace {

CouplingOptions springs() {
  CouplingOptions options;
  options.stiffness = {1, 2, 4};
  options.rotational_stiffness = {10, 20, 40};
  return options;
}

TEST(VirtualCoupling, PullsAlongEachAxisByItsOwnGain) {
  VirtualCoupling coupling(springs());
  const ToolWrench wrench = coupling.update(RigidPose(), RigidPose(Vector3(1, 1, 1)), 1e-3);
  EXPECT_EQ(wrench.force_W, Vector3(1, 2, 4));
  EXPECT_TRUE(wrench.torque_W.isZero(0));
}

TEST(VirtualCoupling, TurnsTowardsTheProxyAboutTheAxisOfTheTurn) {
  VirtualCoupling coupling(springs());
  const RigidPose X_WP(rotation_from_vector(Vector3(0, 0.1, 0)), Vector3::Zero());
  const ToolWrench wrench = coupling.update(RigidPose(), X_WP, 1e-3);
  EXPECT_NEAR(wrench.torque_W.y(), 20 * 0.1, 1e-12);
  EXPECT_NEAR(wrench.torque_W.x(), 0, 1e-12);
}

TEST(VirtualCoupling, DampsTheDeviceThatMovesAgainstARestingProxy) {
  CouplingOptions options = springs();
  options.damping = {0.5, 0.5, 0.5};
  VirtualCoupling coupling(options);
  coupling.update(RigidPose(), RigidPose(), 1e-3);
  const ToolWrench wrench = coupling.update(RigidPose(Vector3(0, 0, 0.001)), RigidPose(), 1e-3);
  EXPECT_NEAR(wrench.force_W.z(), -4 * 0.001 - 0.5 * 1, 1e-12);
}

TEST(VirtualCoupling, ShortensWrenchesToTheLimits) {
  CouplingOptions options = springs();
  options.largest_force = 3;
  options.largest_torque = 0.5;
  VirtualCoupling coupling(options);
  const RigidPose X_WP(rotation_from_vector(Vector3(1, 0, 0)), Vector3(100, 0, 0));
  const ToolWrench wrench = coupling.update(RigidPose(), X_WP, 1e-3);
  EXPECT_NEAR(wrench.force_W.norm(), 3, 1e-12);
  EXPECT_NEAR(wrench.torque_W.norm(), 0.5, 1e-12);
}

// Colgate's condition, by hand: K T / 2 + B = 4 * 0.001 / 2 + 0.1 along z, 40 * 0.001 / 2 about it.
TEST(VirtualCoupling, IsPassiveIfTheDeviceDampsEnough) {
  CouplingOptions options = springs();
  options.damping = {0.1, 0.1, 0.1};
  options.device_damping = 0.1021;
  options.device_rotational_damping = 0.0201;
  EXPECT_TRUE(VirtualCoupling(options).is_passive());
  options.device_damping = 0.1019;
  EXPECT_FALSE(VirtualCoupling(options).is_passive());
  options.device_damping = 0.1021;
  options.device_rotational_damping = 0.0199;
  EXPECT_FALSE(VirtualCoupling(options).is_passive());
}

// A spring that is held between samples returns K T v / 2 of energy per length, both ways: a stroke
// of n steps of length x in and out returns n K x^2 in all.
TEST(VirtualCoupling, ObservesTheEnergyThatAHeldSpringReturns) {
  VirtualCoupling coupling(springs());
  const Scalar x = 0.01;
  const int n = 50;
  for (int k = 0; k <= n; ++k) coupling.update(RigidPose(Vector3(k * x, 0, 0)), RigidPose(), 1e-3);
  for (int k = n - 1; k >= 0; --k) {
    coupling.update(RigidPose(Vector3(k * x, 0, 0)), RigidPose(), 1e-3);
  }
  EXPECT_NEAR(coupling.energy_returned(), n * x * x, 1e-12);
}

TEST(VirtualCoupling, WithDampingOfHalfKTReturnsNothingOverAStroke) {
  CouplingOptions options = springs();
  const Scalar dt = 1e-3;
  options.damping = options.stiffness * dt;
  VirtualCoupling coupling(options);
  for (int k = 0; k <= 400; ++k) {
    const Scalar depth = 1 - std::cos(k * 0.01 * std::acos(-1) / 2);
    coupling.update(RigidPose(Vector3(depth, 0, 0)), RigidPose(), dt);
  }
  EXPECT_LT(coupling.energy_returned(), 0);
}

TEST(VirtualCoupling, EnergyControlTakesTheSurplusBack) {
  CouplingOptions options = springs();
  Scalar surplus[2];
  for (const bool bounds : {false, true}) {
    options.bounds_energy = bounds;
    VirtualCoupling coupling(options);
    for (int k = 0; k <= 4000; ++k) {
      const Scalar depth = 1 - std::cos(k * 0.1);
      coupling.update(RigidPose(Vector3(depth, 0, 0)), RigidPose(), 1e-3);
    }
    surplus[bounds] = coupling.energy_returned();
  }
  EXPECT_GT(surplus[false], 1);
  EXPECT_LT(surplus[true], surplus[false] / 20);
}

TEST(VirtualCoupling, NamesTheOptionThatIsOutOfRange) {
  CouplingOptions options = springs();
  options.stiffness.y() = 0;
  EXPECT_THROW(VirtualCoupling{options}, InvalidArgument);
  options = springs();
  options.largest_force = std::nan("");
  const std::string message = testing::message_of([&] { VirtualCoupling{options}; });
  EXPECT_NE(message.find("largest_force"), std::string::npos) << message;
}

}  // namespace
}  // namespace dyop
