// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>

#include "dyop/tissue/soft_tissue.h"
#include "support/inputs/haptic_scenes.h"
#include "support/inputs/tissue_bars.h"

// Two flat jaws on hinges that close on a thin sheet, whose far end is fixed, and pull.

namespace dyop {
namespace {

using testing::MeshArrays;

constexpr Scalar kSheetPeriod = 0.02;
constexpr Scalar kRestOffset = 0.02;
constexpr Scalar kHingeStiffness = 100;
constexpr Scalar kOpen = 0.15;      // of the jaws at the start, radians
constexpr Scalar kJawFace = 1.3;    // from the hinges' plane
constexpr Scalar kJawCentre = -14;  // along x, from the hinges
const Vector3 kToolStart(38, 0, 0);
const Vector3 kJawHalf(4, 3, 1);

// 30 x 12 x 3 mm, along x, about z = 0.
MeshArrays grasped_sheet() {
  return testing::divided_box({30, 12, 3}, {30, 12, 3}, RigidPose(Vector3(0, -6, -1.5)));
}

SoftTissue make_sheet(const MeshArrays& arrays) {
  SoftTissueOptions options;
  options.material = {0.05, 0.45, 1.05e-9, 20, 0.05};
  options.cube_edge = 1.5;
  options.period = kSheetPeriod;
  options.fixed.emplace_back(Vector3(-1, -20, -20), Vector3(3, 20, 20));
  return {arrays.mesh(), options};
}

// Their axis is y: a positive angle lifts the jaw's tip, which lies along -x.
std::vector<ToolHinge> jaw_hinges() {
  const RigidPose X_TJ(Quaternion(Eigen::AngleAxisd(-std::numbers::pi / 2, Vector3::UnitX())),
                       Vector3::Zero());
  return {{X_TJ, kOpen, kHingeStiffness}, {X_TJ, -kOpen, kHingeStiffness}};
}

// Closes from 0.1 to 0.6 s until the jaws would turn by `squeeze` past each other, then pulls along
// x from 1 to 2 s.
struct Stroke {
  Scalar squeeze = 0;
  Scalar pull = 0;

  ToolPose at(Scalar t) const {
    const Scalar closed = std::clamp((t - 0.1) / 0.5, 0.0, 1.0);
    const Scalar pulled = std::clamp((t - 1) / 1.0, 0.0, 1.0);
    const Scalar angle = kOpen - (kOpen + squeeze) * closed;
    return {RigidPose(kToolStart + Vector3(pull * pulled, 0, 0)), {angle, -angle, 0, 0}};
  }
};

// Of the tool along x, relative to the middle of the sheet's top between the jaws.
Scalar slip_of(const ToolPose& tool, const MeshArrays& arrays, const SoftTissue& sheet) {
  const Vector3 middle(24, 0, 1.5);
  const auto found = std::find_if(arrays.vertices.begin(), arrays.vertices.end(),
                                  [&](const Vector3& p) { return p.isApprox(middle); });
  const Vector3& now = sheet.vertices()[std::size_t(found - arrays.vertices.begin())];
  return (tool.X_WT.translation() - kToolStart).x() - (now - middle).x();
}

// --- joint steps alone, with contacts at all vertices under the jaws ----------------------------

class GraspedSheet {
 public:
  explicit GraspedSheet(Scalar friction) : arrays_(grasped_sheet()), tissue_(make_sheet(arrays_)) {
    tool_.coupling = testing::haptic_options().coupling;
    tool_.coupling.rotational_stiffness.setConstant(2000);
    tool_.hinges = jaw_hinges();
    tool_.rest_offset = kRestOffset;
    tool_.friction = friction;
    tool_.tool = Stroke{}.at(0);
    before_ = {tissue_.vertices().begin(), tissue_.vertices().end()};
  }

  // With contacts as they are, or, as in a session, as they were a step ago.
  void step(const ToolPose& device, bool is_late) {
    tool_.device = device;
    std::vector<Vector3> now(tissue_.vertices().begin(), tissue_.vertices().end());
    JointTool given = tool_;
    if (is_late) {
      given.tool = tool_before_.value_or(tool_.tool);
      given.start = tool_.tool;
    }
    std::vector<ToolContactPoint> contacts = find(given.tool, is_late ? before_ : now);
    tool_before_ = tool_.tool;
    before_ = std::move(now);
    tool_.tool = step_jointly(tissue_, given, contacts).tools[0];
    force_.setZero();
    for (const ToolContactPoint& contact : contacts) force_ += contact.force_W;
  }

  Scalar slip() const { return slip_of(tool_.tool, arrays_, tissue_); }
  const ToolPose& tool() const { return tool_.tool; }
  const Vector3& force() const { return force_; }

 private:
  std::vector<ToolContactPoint> find(const ToolPose& tool, const std::vector<Vector3>& at) const {
    std::vector<ToolContactPoint> contacts;
    std::set<std::int32_t> known;
    for (std::size_t t = 0; t < arrays_.triangles.size(); ++t) {
      for (std::size_t c = 0; c < 3; ++c) {
        const std::int32_t vertex = arrays_.triangles[t][c];
        const Scalar z = arrays_.vertices[std::size_t(vertex)].z();
        if (std::abs(z) < 1.4 || !known.insert(vertex).second) continue;
        const std::size_t jaw = z > 0 ? 0 : 1;
        const Scalar side = z > 0 ? 1 : -1;
        const Quaternion turn(Eigen::AngleAxisd(tool.angles[jaw], Vector3::UnitY()));
        const Vector3 p = turn.conjugate() * (tool.X_WT.inverse() * at[std::size_t(vertex)]);
        if (std::abs(p.x() - kJawCentre) > kJawHalf.x() || std::abs(p.y()) > kJawHalf.y()) continue;
        ToolContactPoint contact;
        contact.nhat_W = tool.X_WT.rotation() * (turn * Vector3(0, 0, side));
        contact.p_WO = at[std::size_t(vertex)];
        contact.p_W = contact.p_WO + (kJawFace - side * p.z()) * contact.nhat_W;
        contact.hinge = jaw;
        SurfacePoint surface{std::int32_t(t), {0, 0, 0}};
        surface.weights[c] = 1;
        contact.surface = surface;
        contacts.push_back(contact);
      }
    }
    return contacts;
  }

  MeshArrays arrays_;
  SoftTissue tissue_;
  JointTool tool_;
  Vector3 force_ = Vector3::Zero();
  std::vector<Vector3> before_;
  std::optional<ToolPose> tool_before_;
};

// The sheet is a fifth thinner between the jaws, and half as long again at the end.
TEST(Grasp, HoldsASheetThatIsPulled) {
  for (const bool is_late : {false, true}) {
    GraspedSheet sheet(1);
    const Stroke stroke{0.12, 12};
    for (int k = 0; k < 175; ++k) sheet.step(stroke.at(kSheetPeriod * k), is_late);
    EXPECT_LT(std::abs(sheet.slip()), 0.3) << is_late;
    EXPECT_LT(sheet.force().x(), -0.8) << is_late;
    // What is symmetric stays so.
    EXPECT_NEAR(sheet.tool().X_WT.translation().z(), 0, 1e-3) << is_late;
    EXPECT_NEAR(sheet.tool().angles[0], -sheet.tool().angles[1], 1e-3) << is_late;
  }
}

TEST(Grasp, StandsStillWhileNothingMoves) {
  GraspedSheet sheet(0.6);
  const Stroke stroke{0.12, 5};
  for (int k = 0; k < 150; ++k) sheet.step(stroke.at(kSheetPeriod * k), true);
  Vector3 last = sheet.force();
  for (int k = 150; k < 170; ++k) {
    sheet.step(stroke.at(kSheetPeriod * k), true);
    EXPECT_LE((sheet.force() - last).norm(), 0.002 * last.norm()) << k;
    last = sheet.force();
  }
}

TEST(Grasp, SlipsOffWithLittleFriction) {
  GraspedSheet sheet(0.2);
  const Stroke stroke{0.12, 15};
  for (int k = 0; k < 175; ++k) sheet.step(stroke.at(kSheetPeriod * k), true);
  EXPECT_GT(sheet.slip(), 14);
  EXPECT_EQ(sheet.force(), Vector3(Vector3::Zero()));
}

// --- in a session -------------------------------------------------------------------------------

struct Grasped {
  Scalar slip_pulled = 0;  // at the end of the pull
  Scalar slip = 0;         // at the end
  Scalar force = 0;
  int unproven = 0;
};

Grasped grasp(Scalar friction, const Stroke& stroke) {
  const MeshArrays arrays = grasped_sheet();
  HapticScene scene;
  scene.hinges = jaw_hinges();
  for (const int side : {1, -1}) {
    const Vector3 centre(kJawCentre, 0, side * (kJawFace + kJawHalf.z()));
    const MeshArrays jaw = testing::divided_box(2 * kJawHalf, {4, 3, 1}, RigidPose(-kJawHalf));
    scene.tool.push_back({testing::shared_mesh(jaw), RigidPose(centre), side > 0 ? 0u : 1u});
  }
  scene.X_WT = RigidPose(kToolStart);
  scene.obstacles.push_back(testing::deforming_tissue(arrays, friction));
  HapticOptions options = testing::haptic_options();
  options.coupling.rotational_stiffness.setConstant(2000);
  const auto model = std::make_shared<SoftTissueModel>(
      make_sheet(arrays),
      ModelledObstacle{options.coupling, scene.hinges, options.rest_offset, friction});
  HapticSession session(scene, options);
  TissueFeed feed;
  feed.period = kSheetPeriod;
  feed.model = model;
  RunnerOptions runner;
  runner.is_paced = false;
  runner.ticks = 2600;
  Grasped result;
  run_session(
      session,
      [&](std::int64_t k) {
        const ToolPose pose = stroke.at(1e-3 * Scalar(k));
        DevicePose device(pose.X_WT);
        device.angles = pose.angles;
        return device;
      },
      {feed},
      [&](const TickRecord& record) {
        const HapticTick& tick = record.tick;
        result.unproven += tick.status == HapticStatus::Overlapping;
        result.slip = slip_of(tick.tool, arrays, model->tissue());
        if (record.number == 2000) result.slip_pulled = result.slip;
        result.force = tick.wrench.force_W.norm();
      },
      runner);
  return result;
}

TEST(Grasp, HoldsInASession) {
  const Grasped held = grasp(0.6, {0.12, 6});
  EXPECT_LT(std::abs(held.slip_pulled), 0.3);
  EXPECT_LT(std::abs(held.slip), 0.6);
  EXPECT_GT(held.force, 0.3);
  EXPECT_EQ(held.unproven, 0);
}

TEST(Grasp, SlipsInASession) {
  const Grasped lost = grasp(0.2, {0.12, 15});
  EXPECT_GT(lost.slip, 14);
  EXPECT_EQ(lost.force, 0);
  EXPECT_EQ(lost.unproven, 0);
}

}  // namespace
}  // namespace dyop
