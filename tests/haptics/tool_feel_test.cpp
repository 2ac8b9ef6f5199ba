// SPDX-License-Identifier: BSD-3-Clause

// What the hand feels, against closed forms.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "dyop/geometry/primitives.h"
#include "dyop/haptics/haptic_session.h"
#include "support/inputs/haptic_scenes.h"

namespace dyop {
namespace {

using testing::ball_tool;
using testing::device_at;
using testing::haptic_options;
using testing::kMillisecond;
using testing::rigid_tissue;
using testing::shared_mesh;

// A single vertex of an octahedron-like tool points down, so that contact is a point.
HapticScene point_tool(const Vector3& p_WT) {
  HapticScene scene;
  scene.tool.push_back({shared_mesh(testing::icosphere(0, 2)), RigidPose()});
  scene.X_WT = RigidPose(p_WT);
  return scene;
}

// With 1 N/mm a depth of d below the place of first contact gives d newtons.
TEST(ToolFeel, PressingIntoAPlaneGivesStiffnessTimesDepth) {
  for (const Scalar depth : {2.5, 5.0, 10.0}) {
    HapticScene scene = ball_tool(2, {0.3, 0.2, 4});
    scene.obstacles.push_back(rigid_tissue(shared_mesh(testing::sheet(40, 16)), RigidPose(), 0.3));
    HapticSession session(scene, haptic_options());
    Vector3 lowest = Vector3::Zero();
    for (const Vector3& p : static_cast<const TriangleMesh&>(*scene.tool[0].shape).vertices()) {
      if (p.z() < lowest.z()) lowest = p;
    }
    const Scalar contact_height = -lowest.z();
    for (int k = 0; k <= 400; ++k) {
      const Scalar height = 4 - (4 - contact_height + depth) * std::min(1.0, k / 300.0);
      session.update(device_at({0.3, 0.2, height}), kMillisecond);
    }
    EXPECT_NEAR(session.last().wrench.force_W.z(), depth, 0.01 * depth);
    EXPECT_EQ(session.last().status, HapticStatus::Held);
  }
}

// No step of more than two percent from tick to tick while sliding at 200 mm/s.
void slide(HapticSession& session, const Vector3& from, const Vector3& to, int ticks,
           Scalar least_force) {
  for (int k = 0; k < 100; ++k) {
    session.update(device_at(from + Vector3(0, 0, 3 * (1 - k / 99.0))), kMillisecond);
  }
  Vector3 last = session.last().wrench.force_W;
  for (int k = 1; k <= ticks; ++k) {
    const HapticTick& tick =
        session.update(device_at(from + (to - from) * k / ticks), kMillisecond);
    const Vector3 force = tick.wrench.force_W;
    EXPECT_GT(force.norm(), least_force) << k;
    EXPECT_LE((force - last).norm(), 0.02 * last.norm()) << k << " " << force.transpose();
    last = force;
  }
}

TEST(ToolFeel, EdgesBetweenTrianglesOfAPlaneAreNotFelt) {
  HapticScene scene = ball_tool(2, {-6, 0.2, 5});
  scene.obstacles.push_back(rigid_tissue(shared_mesh(testing::sheet(40, 16))));
  HapticSession session(scene, haptic_options());
  slide(session, {-6, 0.2, -3}, {6, 1.3, -3}, 60, 4);
}

TEST(ToolFeel, EdgesBetweenTrianglesOfADeformingPlaneAreNotFelt) {
  HapticScene scene = ball_tool(2, {-6, 0.2, 5});
  scene.obstacles.push_back(testing::deforming_tissue(testing::sheet(40, 16)));
  HapticSession session(scene, haptic_options());
  slide(session, {-6, 0.2, -3}, {6, 1.3, -3}, 60, 4);
}

// The ball goes round the edge of a box: the force turns, but does not jump.
TEST(ToolFeel, ASharpConvexEdgeIsRoundedWithoutAJump) {
  HapticScene scene = ball_tool(2, {-5, 0.1, 6}, 3);
  scene.obstacles.push_back(
      rigid_tissue(std::make_shared<Box>(Vector3(6, 6, 6)), RigidPose(Vector3(-6, 0, -6))));
  HapticOptions options = haptic_options();
  options.coupling.rotational_stiffness = Vector3::Constant(2000);
  HapticSession session(scene, options);
  const auto place_at = [](Scalar s) {
    // An arc about the edge, inside the box's skin.
    return Vector3(-1.5 + 1.5 * s, 0.1, -0.5 - 1.5 * s);
  };
  for (int k = 0; k < 100; ++k) {
    session.update(device_at(place_at(0) + Vector3(0, 0, 3 * (1 - k / 99.0))), kMillisecond);
  }
  Vector3 last = session.last().wrench.force_W;
  EXPECT_GT(last.z(), 1.5);
  for (int k = 1; k <= 400; ++k) {
    const HapticTick& tick = session.update(device_at(place_at(k / 400.0)), kMillisecond);
    EXPECT_LE((tick.wrench.force_W - last).norm(), 0.02 * last.norm()) << k;
    last = tick.wrench.force_W;
  }
}

// The tool sticks while the pull is within the cone, and slides at its border: the force along the
// plane is then mu times the force on it.
TEST(ToolFeel, FrictionHoldsUpToCoulombsLimit) {
  HapticScene scene = point_tool({0, 0, 4});
  const Scalar mu = 0.4;
  scene.obstacles.push_back(rigid_tissue(shared_mesh(testing::sheet(80, 4)), RigidPose(), mu));
  HapticOptions options = haptic_options();
  options.coupling.rotational_stiffness = Vector3::Constant(1e6);
  HapticSession session(scene, options);
  for (int k = 0; k <= 200; ++k) {
    session.update(device_at({0, 0, 4 - 6 * k / 200.0}), kMillisecond);
  }
  const Scalar normal = session.last().wrench.force_W.z();
  const Scalar x = session.last().tool.X_WT.translation().x();
  for (int k = 0; k <= 40; ++k) {
    session.update(device_at({0.9 * mu * normal * k / 40, 0, -2}), kMillisecond);
  }
  EXPECT_NEAR(session.last().tool.X_WT.translation().x(), x, 1e-3);
  for (int k = 0; k <= 100; ++k) {
    session.update(device_at({3 * mu * normal * k / 100, 0, -2}), kMillisecond);
  }
  const Vector3 force = session.last().wrench.force_W;
  EXPECT_NEAR(-force.x(), mu * force.z(), 0.01 * force.z());
  EXPECT_GT(session.last().tool.X_WT.translation().x(), x + 1);
}

// Damping of K T dissipates twice what the held spring returns.
TEST(ToolFeel, ClosedStrokesReturnNoEnergy) {
  HapticScene scene = ball_tool(2, {0, 0, 4});
  scene.obstacles.push_back(rigid_tissue(shared_mesh(testing::sheet(40, 16)), RigidPose(), 0.3));
  HapticOptions options = haptic_options();
  options.coupling.damping = options.coupling.stiffness * kMillisecond;
  options.coupling.rotational_damping = options.coupling.rotational_stiffness * kMillisecond;
  HapticSession session(scene, options);
  Scalar least_depth = 4;
  for (int stroke = 0; stroke < 5; ++stroke) {
    for (int k = 0; k <= 300; ++k) {
      const Scalar phase = 2 * std::acos(-1) * k / 300;
      const Vector3 p(3 * std::sin(phase), std::sin(2 * phase), 4 - 3 * (1 - std::cos(phase)));
      least_depth = std::min(least_depth, p.z());
      session.update(device_at(p), kMillisecond);
    }
    EXPECT_LE(session.last().energy_returned, 0) << stroke;
  }
  EXPECT_LT(least_depth, -1);
}

// Presses into an organ, rubs and tilts there, then comes back at 200 mm/s or at once.
// @return Ticks in which the tool was not where the device was, though the device was outside.
int ticks_held_outside(HapticScene scene, const Vector3& away_W, bool at_once) {
  constexpr Scalar kOutside = 11, kDepth = 3;  // from the organ's middle; below its surface, mm
  const HapticOptions options = haptic_options();
  const Vector3 aside_W = away_W.unitOrthogonal();
  scene.X_WT = RigidPose(kOutside * away_W);
  HapticSession session(scene, options);
  const Scalar most_forward = kOutside - 5 + kDepth;
  int held = 0;
  for (int k = 0; k < 500; ++k) {
    const Scalar back = at_once ? most_forward : 0.2 * Scalar(k - 400);
    const Scalar forward =
        k < 400 ? most_forward * std::min(1.0, k / 200.0) : std::max(0.0, most_forward - back);
    const Scalar rub = std::clamp((k - 200) / 100.0, 0.0, 1.0);
    const Vector3 p_WD = (kOutside - forward) * away_W + 2 * rub * aside_W;
    const Matrix3 R_WD = rotation_from_vector(Vector3(0.3 * rub * away_W));
    const HapticTick& tick = session.update(DevicePose(RigidPose(R_WD, p_WD)), kMillisecond);
    EXPECT_GT(tick.clearances[0].lower, 0);
    const bool is_away = (tick.tool.X_WT.translation() - p_WD).norm() > 1e-3;
    if (k >= 400 && forward < 0.3) held += is_away;
    EXPECT_TRUE(is_away || k != 399);
  }
  EXPECT_EQ(session.last().status, HapticStatus::Free);
  EXPECT_EQ(session.last().wrench.force_W.norm(), 0);
  return held;
}

TEST(ToolFeel, LetsGoWithinTenTicksOnceTheWayBackIsFree) {
  const auto organ = testing::icosphere(4, 5);
  for (const bool is_rigid : {true, false}) {
    for (const bool is_ball : {true, false}) {
      HapticScene scene = ball_tool(2, Vector3::Zero());
      if (!is_ball) scene.tool[0].shape = shared_mesh(testing::box_mesh({3, 0.5, 0.5}));
      scene.obstacles.push_back(is_rigid ? rigid_tissue(shared_mesh(organ), RigidPose(), 0.6)
                                         : testing::deforming_tissue(organ, 0.6));
      for (const Vector3& away :
           {Vector3(0, 0, 1), Vector3(0.6, 0, 0.8), Vector3(Vector3(-1, 2, 2) / 3)}) {
        for (const bool at_once : {true, false}) {
          EXPECT_LE(ticks_held_outside(scene, away, at_once), 10)
              << is_rigid << is_ball << at_once << ' ' << away.transpose();
        }
      }
    }
  }
}

}  // namespace
}  // namespace dyop
