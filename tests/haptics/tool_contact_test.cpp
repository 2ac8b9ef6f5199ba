// SPDX-License-Identifier: BSD-3-Clause

// What a model of tissue is told of a tick: contacts with their places on the mesh, impulses, how
// far tissue has come, and the compliance of the springs.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "dyop/core/error.h"
#include "dyop/geometry/primitives.h"
#include "dyop/haptics/haptic_session.h"
#include "support/inputs/haptic_scenes.h"

namespace dyop {
namespace {

using testing::device_at;
using testing::haptic_options;
using testing::kMillisecond;

constexpr Scalar kSheetFriction = 0.3;

std::vector<Vector3> shifted(const std::vector<Vector3>& vertices, const Vector3& by) {
  std::vector<Vector3> result = vertices;
  for (Vector3& p : result) p += by;
  return result;
}

// A ball over a sheet that moves steadily, one snapshot every 3.3 ticks so that most fall into the
// middle of a tick; the device goes with it.
class MovingSheet {
 public:
  explicit MovingSheet(const Vector3& velocity)
      : velocity_(velocity), sheet_(testing::sheet(40, 8)), session_(scene(sheet_), options()) {}

  const HapticTick& tick(const Vector3& device) {
    if (session_.give_snapshot(
            0, shifted(sheet_.vertices, Scalar(given_ + 1) * kPeriod * velocity_), kPeriod)) {
      ++given_;
    }
    return session_.update(device_at(device + session_.time() * velocity_), kMillisecond);
  }
  HapticSession& session() { return session_; }
  const testing::MeshArrays& sheet() const { return sheet_; }

 private:
  static constexpr Scalar kPeriod = 3.3e-3;

  static HapticScene scene(const testing::MeshArrays& sheet) {
    HapticScene scene = testing::ball_tool(2, {0.3, 0.2, 3});
    scene.obstacles.push_back(testing::deforming_tissue(sheet, kSheetFriction));
    return scene;
  }
  static HapticOptions options() { return haptic_options(); }

  Vector3 velocity_;
  testing::MeshArrays sheet_;
  HapticSession session_;
  int given_ = 0;
};

TEST(ToolContact, NamesItsPlaceOnTheMeshAndTheVelocityThere) {
  const Vector3 velocity(4, -3, 2);
  MovingSheet moving(velocity);
  for (int k = 0; k < 100; ++k) moving.tick({0.3, 0.2, 3 - 0.03 * k});
  const HapticTick& tick = moving.session().last();
  ASSERT_FALSE(tick.contacts.empty());
  for (const ToolContactPoint& contact : tick.contacts) {
    ASSERT_TRUE(contact.surface);
    const auto& weights = contact.surface->weights;
    EXPECT_NEAR(weights[0] + weights[1] + weights[2], 1, 1e-12);
    const TriangleIndices& t = moving.sheet().triangles[std::size_t(contact.surface->triangle)];
    Vector3 p_W = Vector3::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_GE(weights[k], -1e-9);
      p_W += weights[k] * moving.sheet().vertices[std::size_t(t[k])];
    }
    // The sheet has only been shifted, until the start of the last motion.
    const Vector3 shift = contact.p_WO - p_W;
    EXPECT_NEAR(shift.cross(velocity).norm(), 0, 1e-6);
    EXPECT_NEAR((contact.v_WO - velocity).norm(), 0, 1e-6);
    EXPECT_NEAR((contact.p_W - contact.p_WO).dot(contact.nhat_W), contact.gap, 1e-9);
    EXPECT_FALSE(contact.hinge);
  }
}

// The tool is pressed 1 deep at 1 N/mm into a sheet without friction; what the sheet takes is what
// the springs pull with, whether or not a snapshot ends within the tick.
TEST(ToolContact, ImpulsesOfATickAreThePullOfTheSprings) {
  MovingSheet moving(Vector3(0, 0, 2));
  Vector3 given = Vector3::Zero();
  Vector3 felt = Vector3::Zero();
  int divided = 0;
  for (int k = 0; k < 400; ++k) {
    const HapticTick& tick = moving.tick({0.3, 0.2, 3 - 2.2 * std::min(1.0, k / 100.0)});
    if (k < 150) continue;
    Vector3 sum = Vector3::Zero();
    for (const ToolImpulse& impulse : tick.impulses) {
      EXPECT_EQ(impulse.obstacle, 0u);
      EXPECT_TRUE(impulse.surface);
      sum += impulse.impulse_W;
    }
    divided += tick.path.size() > 2;
    const Scalar force = tick.wrench.force_W.norm();
    EXPECT_GT(force, 1);
    EXPECT_LE((sum - kMillisecond * tick.wrench.force_W).norm(), 0.02 * kMillisecond * force) << k;
    given += sum;
    felt += kMillisecond * tick.wrench.force_W;
  }
  EXPECT_GT(divided, 50);
  EXPECT_LE((given - felt).norm(), 0.002 * felt.norm());
}

// A face on a fine mesh touches more vertices than a solve takes, all as near: those that are taken
// bear it, and are the same in every tick.
TEST(ToolContact, AFaceRestsOnAFineMesh) {
  for (const int cells : {20, 80, 120}) {
    HapticScene scene;
    scene.tool.push_back({std::make_shared<Box>(Vector3(3, 2, 1)), RigidPose()});
    scene.X_WT = RigidPose(Vector3(0, 0, 3));
    scene.obstacles.push_back(testing::deforming_tissue(testing::sheet(60, cells), 0.4));
    HapticSession session(scene, testing::haptic_options());
    const Scalar pressed = 2;
    for (int k = 0; k < 200; ++k) {
      const Scalar part = std::min(1.0, k / 80.0);
      const HapticTick& tick = session.update(testing::device_at({0, 0, 3 - part * (2 + pressed)}),
                                              testing::kMillisecond);
      if (k < 150) continue;
      EXPECT_NEAR(tick.wrench.force_W.z(), pressed + 0.02, 1e-3) << cells;
      EXPECT_LT(tick.wrench.force_W.head<2>().norm(), 1e-3) << cells;
      EXPECT_LT(tick.wrench.torque_W.norm(), 0.01) << cells;  // it tips at 4
    }
  }
}

TEST(ToolContact, SticksInsideTheConeAndSlipsOnIt) {
  MovingSheet moving(Vector3::Zero());
  const auto state = [&] {
    const auto& contacts = moving.session().last().contacts;
    EXPECT_FALSE(contacts.empty());
    for (const ToolContactPoint& contact : contacts) EXPECT_EQ(contact.state, contacts[0].state);
    return contacts.empty() ? ContactState::Open : contacts[0].state;
  };
  for (int k = 0; k <= 150; ++k) moving.tick({0.3, 0.2, 3 - 0.03 * std::min(k, 100)});
  // Pressed by about 2 N at 1 N/mm: the cone ends 0.6 mm sideways, less for the turn.
  for (int k = 0; k < 20; ++k) moving.tick({0.3 + 0.005 * k, 0.2, 0});
  EXPECT_EQ(state(), ContactState::Stick);
  for (int k = 0; k < 100; ++k) moving.tick({0.4 + 0.02 * k, 0.2, 0});
  EXPECT_EQ(state(), ContactState::Slip);
}

TEST(ToolContact, CandidatesAreNearAndHaveNoForce) {
  MovingSheet moving(Vector3::Zero());
  bool was_seen = false;
  for (int k = 0; k < 100; ++k) {
    const HapticTick& tick = moving.tick({0.3, 0.2, 2.5 - 0.005 * k});
    for (const ToolContactPoint& candidate : tick.candidates) {
      EXPECT_EQ(candidate.state, ContactState::Open);
      EXPECT_TRUE(candidate.force_W.isZero(0));
      EXPECT_GT(candidate.gap, 0);
      was_seen = true;
    }
    for (const ToolContactPoint& contact : tick.contacts) {
      EXPECT_NE(contact.state, ContactState::Open);
      EXPECT_GT(contact.force_W.dot(contact.nhat_W), 0);
    }
  }
  EXPECT_TRUE(was_seen);
}

TEST(ToolContact, TellsHowFarTissueHasCome) {
  const auto sheet = testing::sheet(20, 4);
  HapticScene scene = testing::ball_tool(2, {0, 0, 20});
  scene.obstacles.push_back(testing::deforming_tissue(sheet));
  scene.obstacles.push_back(
      testing::rigid_tissue(testing::shared_mesh(sheet), RigidPose(Vector3(0, 0, -20))));
  HapticSession session(scene, haptic_options());
  EXPECT_EQ(session.last().progress.size(), 2u);
  session.give_snapshot(0, shifted(sheet.vertices, {0, 0, 1}), 0.01);
  for (int k = 1; k <= 15; ++k) {
    const HapticTick& tick = session.update(device_at({0, 0, 20}), kMillisecond);
    EXPECT_EQ(tick.progress[0].snapshot, 1);
    EXPECT_NEAR(tick.progress[0].fraction, std::min(1.0, 0.1 * k), 1e-12);
    EXPECT_EQ(tick.progress[1].snapshot, 0);
    EXPECT_EQ(tick.progress[1].fraction, 1);
    EXPECT_EQ(tick.time, session.time());
  }
}

// The nearest point of a triangle to p, by its faces, edges and corners one after the other.
Vector3 nearest_point(const Triangle& t, const Vector3& p) {
  const Vector3 m = (t[1] - t[0]).cross(t[2] - t[0]);
  const Vector3 foot = p - m * (m.dot(p - t[0]) / m.squaredNorm());
  bool is_inside = true;
  Vector3 best = t[0];
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector3& a = t[k];
    const Vector3& b = t[(k + 1) % 3];
    is_inside &= m.dot((b - a).cross(foot - a)) >= 0;
    const Scalar s = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
    const Vector3 on_edge = a + s * (b - a);
    if ((p - on_edge).norm() < (p - best).norm()) best = on_edge;
  }
  return is_inside ? foot : best;
}

// A ball over a sheet of hills, half way between two snapshots, against all triangles one by one.
TEST(ToolContact, FoundOnesAreThoseOfAllTriangles) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<Scalar> uniform(-1, 1);
  constexpr Scalar kRadius = 3, kReach = 1.5;
  const auto sheet = testing::sheet(20, 10);
  std::vector<Vector3> begin = sheet.vertices;
  std::vector<Vector3> end = sheet.vertices;
  for (Vector3& p : begin) p.z() += 0.5 * uniform(random);
  for (Vector3& p : end) p.z() += 0.5 * uniform(random);
  HapticScene scene;
  scene.tool.push_back({std::make_shared<Sphere>(kRadius), RigidPose()});
  scene.X_WT = RigidPose(Vector3(0, 0, 50));
  ToolObstacle organ = testing::deforming_tissue(sheet);
  organ.vertices = begin;
  scene.obstacles.push_back(organ);
  HapticSession session(scene, haptic_options());
  ASSERT_TRUE(session.give_snapshot(0, end, 0.01));
  for (int k = 0; k < 4; ++k) session.update(device_at({0, 0, 50}), kMillisecond);
  const ObstacleProgress progress = session.last().progress[0];
  EXPECT_NEAR(progress.fraction, 0.4, 1e-9);
  std::vector<ToolContactPoint> contacts;
  int compared = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const Vector3 center(6 * uniform(random), 6 * uniform(random), kRadius + 1 + uniform(random));
    const ToolPose tool{RigidPose(center), {}};
    Scalar least = kInfinity;
    const auto corner = [&](std::int32_t k) -> Vector3 {
      return begin[std::size_t(k)] +
             progress.fraction * (end[std::size_t(k)] - begin[std::size_t(k)]);
    };
    for (std::size_t k = 0; k < sheet.triangles.size(); ++k) {
      const TriangleIndices& t = sheet.triangles[k];
      const Triangle triangle{corner(t[0]), corner(t[1]), corner(t[2])};
      const Scalar gap = (center - nearest_point(triangle, center)).norm() - kRadius;
      least = std::min(least, gap);
    }
    ASSERT_TRUE(session.find_contacts(0, progress, tool, {kReach, 1, 0}, contacts));
    if (least <= 0) continue;
    ++compared;
    ASSERT_EQ(contacts.empty(), least > kReach);
    for (const ToolContactPoint& contact : contacts) {
      EXPECT_EQ(contact.state, ContactState::Open);
      const TriangleIndices& t = sheet.triangles[std::size_t(contact.surface->triangle)];
      const Triangle triangle{corner(t[0]), corner(t[1]), corner(t[2])};
      const Vector3 nearest = nearest_point(triangle, center);
      EXPECT_NEAR((contact.p_WO - nearest).norm(), 0, 1e-6);
      EXPECT_NEAR(contact.gap, (center - nearest).norm() - kRadius, 1e-9);
      EXPECT_LE(contact.gap, kReach * (1 + 1e-9));
      Vector3 v = Vector3::Zero();
      for (std::size_t k = 0; k < 3; ++k) {
        const auto vertex = std::size_t(t[k]);
        v += contact.surface->weights[k] * (end[vertex] - begin[vertex]) / 0.01;
      }
      EXPECT_NEAR((contact.v_WO - v).norm(), 0, 1e-6);
    }
    if (!contacts.empty()) {
      EXPECT_NEAR(contacts[0].gap, least, 1e-9);
    }
    // The minima of the gap are among them; apart from each other there are fewer.
    const std::size_t all = contacts.size();
    ASSERT_TRUE(session.find_contacts(0, progress, tool, {kReach, 0, 0}, contacts));
    EXPECT_LE(contacts.size(), all);
    ASSERT_TRUE(session.find_contacts(0, progress, tool, {kReach, 1, 1.0}, contacts));
    for (std::size_t a = 0; a < contacts.size(); ++a) {
      for (std::size_t b = 0; b < a; ++b) {
        EXPECT_GE((contacts[a].p_W - contacts[b].p_W).norm(), 1);
      }
    }
  }
  EXPECT_GT(compared, 10);
  // A mesh that is no longer there.
  EXPECT_FALSE(session.find_contacts(0, {7, 0}, {}, {kReach, 0, 0}, contacts));
  EXPECT_THROW(session.find_contacts(0, progress, {}, {0, 0, 0}, contacts), InvalidArgument);
}

// Forces on points of the tool, small ones, displace it until the springs balance them: the wrench
// of the coupling for the displaced tool is theirs, reversed.
TEST(ToolContact, CompliancesBalanceTheForcesOnTheTool) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<Scalar> uniform(-1, 1);
  const auto vector = [&] { return Vector3(uniform(random), uniform(random), uniform(random)); };
  for (int trial = 0; trial < 100; ++trial) {
    CouplingOptions coupling;
    coupling.stiffness = Vector3(1, 2, 3) + 0.5 * vector();
    coupling.rotational_stiffness = Vector3(200, 300, 400) + 50 * vector();
    const std::vector<ToolHinge> hinges{
        {RigidPose(rotation_from_vector(vector()), 3 * vector()), 0, 70}};
    ToolPose tool{RigidPose(rotation_from_vector(vector()), 10 * vector()), {0.2}};
    const std::vector<ToolPoint> points{{tool.X_WT.translation() + 5 * vector(), {}},
                                        {tool.X_WT.translation() + 5 * vector(), 0}};
    Eigen::VectorXd forces(6);
    forces << 1e-4 * vector(), 1e-4 * vector();
    const Eigen::MatrixXd C = coupling_compliance(coupling, hinges, tool, points);
    ASSERT_EQ(C.rows(), 6);
    EXPECT_LE((C - C.transpose()).norm(), 1e-12 * C.norm());
    Eigen::VectorXd pull = Eigen::VectorXd::Zero(7);
    for (std::size_t k = 0; k < 2; ++k) {
      pull += tool_jacobian(hinges, tool, points[k]).transpose() *
              forces.segment<3>(3 * Eigen::Index(k));
    }
    const Eigen::VectorXd x = coupling_compliance(coupling, hinges).cwiseProduct(pull);
    const ToolPose moved{RigidPose(rotation_from_vector(x.segment<3>(3)) * tool.X_WT.rotation(),
                                   tool.X_WT.translation() + x.head<3>()),
                         {tool.angles[0] + x[6]}};
    EXPECT_LE((tool_displacement(1, tool, moved) - x).norm(), 1e-12);
    const ToolPose there = displaced(tool, x);
    EXPECT_LE((there.X_WT.translation() - moved.X_WT.translation()).norm(), 1e-12);
    EXPECT_LE((there.X_WT.rotation() - moved.X_WT.rotation()).norm(), 1e-12);
    EXPECT_EQ(there.angles[0], moved.angles[0]);
    const ToolWrench wrench = VirtualCoupling(coupling).update(tool.X_WT, moved.X_WT, 0);
    const Vector3 force_W = forces.head<3>() + forces.tail<3>();
    const Vector3 p_WT = tool.X_WT.translation();
    const Vector3 torque_W = (points[0].p_W - p_WT).cross(forces.head<3>()) +
                             (points[1].p_W - p_WT).cross(forces.tail<3>());
    EXPECT_LE((wrench.force_W - force_W).norm(), 1e-9 * force_W.norm());
    EXPECT_LE((wrench.torque_W - torque_W).norm(), 1e-6 * torque_W.norm() + 1e-12);
    // The points move as C says, to the first order.
    const RigidPose X_WJ = tool.X_WT * hinges[0].X_TJ;
    const RigidPose turn(rotation_from_vector(x[6] * Vector3::UnitZ()), Vector3::Zero());
    const Vector3 p0 = moved.X_WT * (tool.X_WT.inverse() * points[0].p_W);
    const Vector3 p1 = moved.X_WT * hinges[0].X_TJ * turn * (X_WJ.inverse() * points[1].p_W);
    Eigen::VectorXd displaced(6);
    displaced << p0 - points[0].p_W, p1 - points[1].p_W;
    EXPECT_LE((displaced - C * forces).norm(), 1e-4 * displaced.norm());
  }
  const std::vector<ToolPoint> wrong{{Vector3::Zero(), 1}};
  CouplingOptions coupling;
  coupling.stiffness = coupling.rotational_stiffness = Vector3::Ones();
  EXPECT_THROW(coupling_compliance(coupling, {}, {}, wrong), InvalidArgument);
}

}  // namespace
}  // namespace dyop
