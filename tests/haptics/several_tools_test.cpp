// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/primitives.h"
#include "dyop/haptics/haptic_session.h"
#include "support/allocation_count.h"
#include "support/inputs/haptic_scenes.h"
#include "support/inputs/random_inputs.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using testing::device_at;
using testing::haptic_options;
using testing::kMillisecond;
using testing::message_of;
using testing::random_direction;
using testing::random_number;
using testing::random_vector;

using Devices = std::array<DevicePose, 2>;

ToolPart part_of(std::shared_ptr<const Shape> shape, const RigidPose& X_TP = {},
                 std::optional<std::size_t> hinge = {}) {
  return {std::move(shape), X_TP, hinge};
}

// Two balls, on the x axis.
HapticScene two_balls(Scalar radius, Scalar apart) {
  HapticScene scene;
  scene.tool.push_back(part_of(std::make_shared<Sphere>(radius)));
  scene.X_WT = RigidPose(Vector3(-apart / 2, 0, 0));
  HapticTool other;
  other.parts.push_back(part_of(std::make_shared<Sphere>(radius)));
  other.X_WT = RigidPose(Vector3(apart / 2, 0, 0));
  scene.more_tools.push_back(other);
  return scene;
}

// Part of the way at constant rates.
RigidPose between(const RigidPose& from, const RigidPose& to, Scalar part) {
  const Eigen::AngleAxis<Scalar> turn(Matrix3(to.rotation() * from.rotation().transpose()));
  const Eigen::AngleAxis<Scalar> turned(part * turn.angle(), turn.axis());
  return RigidPose(Matrix3(turned.toRotationMatrix() * from.rotation()),
                   (1 - part) * from.translation() + part * to.translation());
}

Vector3 place_of(const HapticSession& session, std::size_t tool) {
  return session.last(tool).tool.X_WT.translation();
}

// The springs of both hands are in series: each feels what the other does.
TEST(SeveralTools, PushEachOtherWithOneForce) {
  for (const Scalar stiffness : {1.0, 0.2, 5.0}) {
    HapticScene scene = two_balls(2, 6);
    scene.more_tools[0].coupling = haptic_options().coupling;
    scene.more_tools[0].coupling->stiffness.setConstant(stiffness);
    scene.tool_margin = 0.1;
    HapticSession session(scene, haptic_options());
    ASSERT_EQ(session.tool_count(), 2u);
    for (int k = 0; k <= 300; ++k) {
      const Scalar half = std::max(1.0, 3 - 0.01 * k);
      session.update(Devices{device_at({-half, 0, 0}), device_at({half, 0, 0})}, kMillisecond);
    }
    const Scalar overlap = 4 + 0.1 + haptic_options().rest_offset - 2;
    const Scalar force = overlap / (1 + 1 / stiffness);
    for (const std::size_t tool : {0, 1}) {
      const Scalar side = tool == 0 ? -1 : 1;
      EXPECT_EQ(session.last(tool).status, HapticStatus::Held);
      EXPECT_NEAR(session.last(tool).wrench.force_W.x(), side * force, 1e-3 * force) << stiffness;
      ASSERT_EQ(session.last(tool).tool_contacts.size(), 1u);
      const ToolContactPoint& contact = session.last(tool).tool_contacts[0];
      EXPECT_EQ(contact.obstacle, 1 - tool);
      EXPECT_NEAR(contact.force_W.x(), side * force, 1e-3 * force);
      EXPECT_NEAR(contact.nhat_W.x(), side, 1e-9);
      EXPECT_LT((contact.p_W - (place_of(session, tool) - Vector3(2 * side, 0, 0))).norm(), 1e-6);
      const ToolClearance& clearance = session.last(tool).tool_clearances[1 - tool];
      const Scalar gap = (place_of(session, 0) - place_of(session, 1)).norm() - 4;
      EXPECT_LE(clearance.lower, gap + 1e-9);
      EXPECT_GE(clearance.upper, gap - 1e-9);
      EXPECT_LE(clearance.upper - clearance.lower, 0.02 * gap + 0.01);
      EXPECT_EQ(session.last(tool).tool_clearances[tool].lower, kInfinity);
    }
  }
}

// A tool that nobody holds against is pushed along, at its springs' force.
TEST(SeveralTools, ThePushedToolGivesWayAndComesBack) {
  HapticSession session(two_balls(2, 6), haptic_options());
  for (int k = 0; k <= 400; ++k) {
    const Scalar x = k <= 200 ? -3 + 0.02 * k : 1 - 0.02 * (k - 200);
    session.update(Devices{device_at({x, 0, 0}), device_at({3, 0, 0})}, kMillisecond);
    const Scalar gap = place_of(session, 1).x() - place_of(session, 0).x() - 4;
    EXPECT_GE(gap, 0.3 * haptic_options().rest_offset / 4) << k;
    if (k == 200) {
      EXPECT_GT(place_of(session, 1).x(), 3.9);
    }
  }
  EXPECT_NEAR(place_of(session, 1).x(), 3, 1e-6);
  EXPECT_EQ(session.last(1).status, HapticStatus::Free);
}

// Friction between tools: inside the cone the pushed tool follows across, outside it slides.
TEST(SeveralTools, CarryEachOtherByFriction) {
  for (const Scalar friction : {0.0, 0.2, 1.0}) {
    HapticScene scene = two_balls(2, 4.1);
    scene.tool_friction = friction;
    HapticOptions options = haptic_options();
    options.coupling.rotational_stiffness.setConstant(1e5);
    HapticSession session(scene, options);
    // Pressed together along x with 1 N, then the first is drawn along y by 0.3.
    for (int k = 0; k <= 600; ++k) {
      const Scalar x = std::min(0.01 * k, 1.0);
      const Scalar y = std::clamp(0.001 * (k - 250), 0.0, 0.3);
      session.update(Devices{device_at({-2.05 + x, y, 0}), device_at({2.05 - x, 0, 0})},
                     kMillisecond);
    }
    const Vector3& force_W = session.last(1).tool_contacts.at(0).force_W;
    const Vector3& n = session.last(1).tool_contacts.at(0).nhat_W;
    const Scalar pressure = force_W.dot(n);
    const Scalar across = (force_W - pressure * n).norm();
    EXPECT_LE(across, friction * pressure * (1 + 1e-6) + 1e-9);
    if (friction == 1) {
      EXPECT_LT(across, 0.3 * pressure);
      EXPECT_NEAR(place_of(session, 1).y(), 0.15, 0.02);  // half of the way each
    }
    if (friction == 0) {
      EXPECT_NEAR(across, 0, 1e-9);
    }
  }
}

// Two jaws close on the shaft of the other tool, along z: they stop there, with the torque of their
// hinges, and the shaft is held between them.
TEST(SeveralTools, JawsHoldTheShaftOfTheOther) {
  HapticScene scene;
  const auto jaw = std::make_shared<Box>(Vector3(5, 0.5, 1));
  for (const Scalar side : {1.0, -1.0}) {
    const std::size_t hinge = scene.hinges.size();
    scene.hinges.push_back({RigidPose(), side * 0.4, 100});
    scene.tool.push_back(part_of(jaw, RigidPose(Vector3(6, side * 0.6, 0)), hinge));
  }
  HapticTool shaft;
  shaft.parts.push_back(part_of(std::make_shared<Capsule>(1, 10)));
  shaft.X_WT = RigidPose(Vector3(8, 0, 0));
  scene.more_tools.push_back(shaft);
  scene.tool_friction = 0.5;
  HapticSession session(scene, haptic_options());
  Devices devices{device_at({0, 0, 0}), device_at({8, 0, 0})};
  const auto pressure_of = [&](std::size_t part) {
    Scalar sum = 0;
    for (const ToolContactPoint& contact : session.last().tool_contacts) {
      if (contact.part == part) sum += contact.force_W.dot(contact.nhat_W);
    }
    return sum;
  };
  for (int k = 0; k <= 400; ++k) {
    const Scalar open = std::max(-0.3, 0.4 - 0.002 * k);
    devices[0].angles = {open, -open, 0, 0};
    session.update(devices, kMillisecond);
    EXPECT_GE(session.last().tool_clearances[1].upper, 0) << k;
  }
  // Each jaw is held by what its spring pulls with: torque over lever.
  const Scalar wanted = devices[0].angles[0];
  const Scalar torque = 100 * (session.last().tool.angles[0] - wanted);
  EXPECT_GT(torque, 20);
  EXPECT_NEAR(pressure_of(0) * 8, torque, 0.15 * torque);
  EXPECT_NEAR(pressure_of(1), pressure_of(0), 0.02 * pressure_of(0));
  EXPECT_NEAR(place_of(session, 1).y(), 0, 1e-3);
  // Lifted along z the shaft sticks: its springs pull it back with less than friction holds.
  for (int k = 0; k <= 500; ++k) {
    devices[0].p_WD.z() = std::min(0.004 * k, 1.0);
    session.update(devices, kMillisecond);
  }
  const Scalar lifted = place_of(session, 1).z();
  EXPECT_NEAR(lifted, (session.last().tool.X_WT * Vector3(8, 0, 0)).z(), 0.02);
  EXPECT_GT(lifted, 0.4);
  // And when they open it goes back.
  for (int k = 0; k <= 400; ++k) {
    devices[0].angles = {0.4, -0.4, 0, 0};
    session.update(devices, kMillisecond);
  }
  EXPECT_NEAR(place_of(session, 1).z(), 0, 1e-6);
}

// Whatever the devices do, neither tool comes nearer to the other, or to the wall between them,
// than is promised, at a hundred times of each motion; and they go on moving.
TEST(SeveralTools, StayApartUnderWildDevices) {
  std::mt19937_64 random(21);
  const Scalar kept = 0.3 * haptic_options().rest_offset / 4;
  for (int run = 0; run < 12; ++run) {
    HapticScene scene;
    scene.tool.push_back(part_of(
        run % 3 == 0 ? testing::shared_mesh(testing::icosphere(1, 2))
                     : std::shared_ptr<const Shape>(std::make_shared<Box>(Vector3(1, 1, 3)))));
    scene.X_WT = RigidPose(Vector3(-5, 0, 0));
    HapticTool other;
    other.parts.push_back(part_of(std::make_shared<Capsule>(0.7, 6)));
    other.X_WT = RigidPose(Vector3(5, 0, 0));
    scene.more_tools.push_back(other);
    scene.tool_friction = run % 2 == 0 ? 0.3 : 0;
    const auto wall = std::make_shared<Box>(Vector3(20, 20, 1));
    const RigidPose X_WO(Vector3(0, 0, -8.5));
    scene.obstacles.push_back(testing::rigid_tissue(wall, X_WO, 0.3));
    HapticSession session(scene, haptic_options());
    const std::array<const Shape*, 2> shapes{scene.tool[0].shape.get(), other.parts[0].shape.get()};
    Devices devices{device_at({-5, 0, 0}), device_at({5, 0, 0})};
    int moved = 0, met = 0;
    for (int k = 0; k < 400; ++k) {
      for (DevicePose& device : devices) {
        const Scalar speed = run % 4 == 0 ? 1 : 0.05;
        if (k % 25 == 0) device.p_WD = random_vector(4, random);
        device.p_WD += random_vector(speed, random);
        device.q_WD =
            (device.q_WD * Quaternion(Eigen::AngleAxis<Scalar>(random_number(0, speed, random),
                                                               random_direction(random))))
                .normalized();
      }
      session.update(devices, kMillisecond);
      const auto& path = session.last(0).path;
      ASSERT_EQ(path.size(), session.last(1).path.size());
      moved += path.size() > 1;
      met += !session.last(0).tool_contacts.empty();
      for (std::size_t i = 1; i < path.size(); ++i) {
        const auto& others = session.last(1).path;
        for (int n = 0; n <= 20; ++n) {
          const RigidPose a = between(path[i - 1].tool.X_WT, path[i].tool.X_WT, n / 20.0);
          const RigidPose b = between(others[i - 1].tool.X_WT, others[i].tool.X_WT, n / 20.0);
          EXPECT_GE(distance(*shapes[0], a, *shapes[1], b).lower, kept * (1 - 1e-6))
              << run << ' ' << k;
          EXPECT_GE(distance(*wall, X_WO, *shapes[0], a).lower, kept * (1 - 1e-6));
          EXPECT_GE(distance(*wall, X_WO, *shapes[1], b).lower, kept * (1 - 1e-6));
        }
      }
      const RigidPose a = session.last(0).tool.X_WT, b = session.last(1).tool.X_WT;
      const DistanceResult apart = distance(*shapes[0], a, *shapes[1], b);
      EXPECT_LE(session.last(0).tool_clearances[1].lower, apart.upper * (1 + 1e-9));
      EXPECT_GE(session.last(1).tool_clearances[0].upper, apart.lower * (1 - 1e-9));
    }
    EXPECT_GT(moved, 390) << run;
    EXPECT_GT(met, 20) << run;
  }
}

// What starts across the other leaves it, and says so of both; from then on they are kept apart.
TEST(SeveralTools, LeaveEachOtherWhereTheyOverlap) {
  HapticSession session(two_balls(2, 3), haptic_options());
  int overlapping = 0;
  for (int k = 0; k <= 400; ++k) {
    session.update(Devices{device_at({-1.5, 0, 0}), device_at({1.5, 0, 0})}, kMillisecond);
    const bool is_over = session.last(0).status == HapticStatus::Overlapping;
    EXPECT_EQ(session.last(1).status == HapticStatus::Overlapping, is_over) << k;
    overlapping += is_over;
  }
  EXPECT_GT(overlapping, 10);
  EXPECT_EQ(session.last(0).status, HapticStatus::Held);
  EXPECT_GE((place_of(session, 0) - place_of(session, 1)).norm(), 4);
}

// Tissue that closes in on both, and a tool that does not know its device.
TEST(SeveralTools, ADeadDeviceDoesNotStopTheOther) {
  HapticScene scene = two_balls(1, 6);
  auto sheet = testing::sheet(20, 8);
  for (Vector3& v : sheet.vertices) v.z() -= 2;
  scene.obstacles.push_back(testing::deforming_tissue(sheet));
  HapticSession session(scene, haptic_options());
  Devices devices{device_at({-3, 0, 0}), device_at({3, 0, 0})};
  session.update(devices, kMillisecond);
  devices[1].p_WD.setConstant(std::nan(""));
  for (Vector3& v : sheet.vertices) v.z() += 3;
  ASSERT_TRUE(session.give_snapshot(0, sheet.vertices, 0.2));
  for (int k = 0; k < 300; ++k) {
    devices[0].p_WD.x() += 0.01;
    session.update(devices, kMillisecond);
    EXPECT_EQ(session.last(1).status, HapticStatus::InvalidInput);
    EXPECT_TRUE(session.last(1).wrench.force_W.isZero(0));
  }
  EXPECT_EQ(session.last(0).tissue_stopped, 0);
  EXPECT_NEAR(place_of(session, 1).z(), 2.02, 1e-3);  // pushed by tissue
  EXPECT_NEAR(place_of(session, 0).z(), 2.02, 1e-3);
  EXPECT_NEAR(place_of(session, 0).x(), 0, 1e-3);  // and went on
}

// Deep in an organ that heaves, its hand tilting or jumping, one tool is held, slips and is stopped
// short. The other, in free air, is where its own hand is all the same.
TEST(SeveralTools, OneThatIsStoppedShortDoesNotHoldTheOther) {
  int short_ticks = 0, behind = 0;
  for (int run = 0; run < 6; ++run) {
    std::mt19937_64 random(31 + run);
    HapticScene scene;
    scene.tool.push_back(part_of(std::make_shared<Box>(Vector3(1, 2, 3))));
    scene.X_WT = RigidPose(Vector3(0, 0, 14));
    HapticTool other;
    other.parts.push_back(part_of(std::make_shared<Sphere>(1)));
    other.X_WT = RigidPose(Vector3(40, 0, 0));
    scene.more_tools.push_back(other);
    const auto organ = testing::icosphere(3, 10);
    scene.obstacles.push_back(testing::deforming_tissue(organ, 0.3));
    const auto walls = std::make_shared<Box>(Vector3(1, 20, 20));
    scene.obstacles.push_back(testing::rigid_tissue(walls, RigidPose(Vector3(-5, 0, 10)), 0.3));
    HapticSession session(scene, haptic_options());
    Devices devices{device_at({0, 0, 14}), device_at({40, 0, 0})};
    const Vector3 turn = random_vector(1, random);
    for (int k = 0; k < 600; ++k) {
      if (k % 20 == 0) {
        auto heaved = organ.vertices;
        for (Vector3& v : heaved) v *= 1 + 0.05 * std::sin(0.02 * k + 0.1 * v.x());
        session.give_snapshot(0, heaved, 0.02);
      }
      const Scalar t = 0.01 * k;
      devices[0].p_WD = Vector3(-2 * std::sin(t), 3 * std::sin(2 * t), std::max(2.0, 14 - 4 * t));
      if (k % 150 > 130) devices[0].p_WD += 20 * turn;
      devices[0].q_WD = Quaternion(rotation_from_vector(Vector3(std::sin(3 * t) * turn)));
      devices[1].p_WD = Vector3(40 + 3 * std::sin(5 * t), 3 * std::cos(5 * t), t);
      session.update(devices, kMillisecond);
      const bool is_short = session.last(0).status == HapticStatus::Blocked ||
                            session.last(0).status == HapticStatus::Trapped;
      const bool is_behind = (place_of(session, 1) - devices[1].p_WD).norm() > 1e-6;
      short_ticks += is_short;
      behind += is_behind;
    }
  }
  EXPECT_GT(short_ticks, 15);
  EXPECT_EQ(behind, 0);
}

// The same inputs give the same bits, wherever ticks were cut off, and nothing is allocated.
TEST(SeveralTools, ReplayToTheBit) {
  HapticScene scene = two_balls(2, 6);
  scene.tool_friction = 0.3;
  HapticOptions options = haptic_options();
  options.max_work = 12;
  options.clearance_work = 10;
  HapticSession session(scene, options), again(scene, haptic_options());
  std::mt19937_64 random(22);
  Devices devices{device_at({-3, 0, 0}), device_at({3, 0, 0})};
  int cut = 0;
  std::size_t allocations = 0;
  for (int k = 0; k < 500; ++k) {
    for (DevicePose& device : devices) device.p_WD = random_vector(3, random);
    const std::size_t before = testing::allocation_count();
    session.update(devices, kMillisecond);
    if (k > 100) allocations += testing::allocation_count() - before;
    const auto ticks = again.replay(devices, kMillisecond, session.last().cutoff);
    cut += session.last().cutoff.has_value();
    for (const std::size_t tool : {0, 1}) {
      EXPECT_EQ(ticks[tool].tool.X_WT.translation(), place_of(session, tool)) << k;
      EXPECT_EQ(ticks[tool].wrench.force_W, session.last(tool).wrench.force_W) << k;
    }
  }
  EXPECT_GT(cut, 50);
  EXPECT_EQ(allocations, 0u);
}

TEST(SeveralTools, EachHasItsOwnTrocarPlaceAndSprings) {
  HapticScene scene = two_balls(0.5, 6);
  scene.more_tools[0].trocar = ToolTrocar{Vector3(3, 0, 10), Vector3::Zero(), Vector3::UnitZ()};
  HapticSession session(scene, haptic_options());
  for (int k = 0; k < 200; ++k) {
    session.update(Devices{device_at({-3, 0, 0}), device_at({3 + 0.005 * k, 0, 0})}, kMillisecond);
  }
  const RigidPose& X_WT = session.last(1).tool.X_WT;
  const Vector3 away = Vector3(3, 0, 10) - X_WT.translation();
  EXPECT_LE(away.cross(X_WT.rotation().col(2)).norm(), haptic_options().rest_offset);
  EXPECT_GT(session.last(1).trocar_force_W.norm(), 0.1);
  EXPECT_TRUE(session.last(0).trocar_force_W.isZero(0));
  CouplingOptions stiff = haptic_options().coupling;
  stiff.stiffness.setConstant(0.5);
  session.set_coupling(stiff, 1);
  EXPECT_EQ(session.coupling(1).stiffness.x(), 0.5);
  EXPECT_EQ(session.coupling(0).stiffness.x(), 1);
  session.reset({RigidPose(Vector3(20, 0, 0)), {}}, 1);
  EXPECT_EQ(session.last(1).status, HapticStatus::NotRun);
  EXPECT_EQ(place_of(session, 1).x(), 20);
  EXPECT_NEAR(place_of(session, 0).x(), -3, 1e-9);
  session.update(Devices{device_at({-3, 0, 0}), device_at({20, 0, 0})}, kMillisecond);
  EXPECT_GE(session.last(0).tool_clearances[1].lower, 21);
}

TEST(SeveralTools, RefuseWhatCannotBe) {
  HapticScene scene = two_balls(1, 6);
  HapticSession session(scene, haptic_options());
  EXPECT_THROW(session.update(device_at({0, 0, 0}), kMillisecond), InvalidArgument);
  EXPECT_THROW(session.last(2), InvalidArgument);
  EXPECT_THROW(session.reset({}, 2), InvalidArgument);
  EXPECT_THROW(session.set_coupling(haptic_options().coupling, 2), InvalidArgument);
  scene.tool_margin = -1;
  EXPECT_THROW(HapticSession(scene, haptic_options()), InvalidArgument);
  scene.tool_margin = 0;
  scene.tool_friction = std::nan("");
  EXPECT_THROW(HapticSession(scene, haptic_options()), InvalidArgument);
  scene.tool_friction = 0;
  scene.more_tools.resize(kMostTools, scene.more_tools[0]);
  EXPECT_THROW(HapticSession(scene, haptic_options()), InvalidArgument);
  scene.more_tools.resize(1);
  scene.more_tools[0].parts.clear();
  EXPECT_THROW(HapticSession(scene, haptic_options()), InvalidArgument);
}

TEST(SeveralTools, ErrorsNameTheTool) {
  const auto expect_error = [](const HapticScene& scene, const std::string& expected) {
    const std::string error = message_of([&] { HapticSession(scene, haptic_options()); });
    EXPECT_NE(error.find("HapticSession: " + expected), std::string::npos) << error;
  };
  const HapticScene good = two_balls(1, 6);
  HapticScene scene = good;
  scene.more_tools[0].hinges.resize(2, {{}, 0, 1});
  scene.more_tools[0].parts.push_back(part_of(std::make_shared<Sphere>(1), {}, 6));
  expect_error(scene, "tool 1, part 1 names hinge 6 of 2");
  scene.more_tools[0].parts[1].hinge = 0;
  expect_error(scene, "tool 1, hinge 1 has no parts");
  scene.more_tools[0].parts[0].shape = nullptr;
  expect_error(scene, "tool 1, part 0 has no shape");
  scene.more_tools[0].parts.clear();
  expect_error(scene, "tool 1 needs at least one part");
  scene = good;
  scene.tool[0].hinge = 0;
  expect_error(scene, "tool 0, part 0 names hinge 0 of 0");
}

}  // namespace
}  // namespace dyop
