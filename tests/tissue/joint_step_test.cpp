// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "dyop/tissue/soft_tissue.h"
#include "support/inputs/tissue_bars.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using testing::message_of;

constexpr Scalar kBlockModulus = 2;
constexpr Scalar kPlateFriction = 0.5;

// A block of 4 x 4 x 3 that stands on its lowest cubes, and a plate on springs over its top, which
// touches it at all vertices. Without lateral strain (Poisson's ratio 0) a column: closed forms.
class PlateOnBlock {
 public:
  PlateOnBlock(Scalar stiffness, Scalar period, Scalar friction)
      : arrays_(testing::divided_box({4, 4, 3}, {4, 4, 3})),
        tissue_(TriangleMesh(arrays_.vertices, arrays_.triangles), options(period)) {
    tool_.coupling.stiffness.setConstant(stiffness);
    tool_.coupling.rotational_stiffness.setConstant(1000 * stiffness);
    tool_.friction = friction;
    tool_.tool.X_WT = tool_.device.X_WT = RigidPose(Vector3(2, 2, 3));
    for (std::size_t t = 0; t < arrays_.triangles.size(); ++t) {
      for (std::size_t c = 0; c < 3; ++c) add(t, c);
    }
  }

  // Column of the height above the fixed cubes' tops, springs and plate in balance.
  static Scalar stiffness_of_block() { return kBlockModulus * 16 / 3; }

  void press(const Vector3& device) { tool_.device.X_WT = RigidPose(Vector3(2, 2, 3) + device); }

  JointReport step() {
    std::vector<ToolContactPoint> contacts;
    for (const Place& place : places_) {
      ToolContactPoint contact;
      contact.p_WO = tissue_.vertices()[place.vertex];
      contact.p_W = tool_.tool.X_WT * place.on_plate;
      contact.nhat_W = Vector3::UnitZ();
      contact.surface = place.surface;
      contacts.push_back(contact);
    }
    const JointReport report = step_jointly(tissue_, tool_, contacts);
    force_.setZero();
    for (const ToolContactPoint& contact : contacts) {
      force_ += contact.force_W;
      EXPECT_GE(contact.force_W.z(), 0);
      EXPECT_LE(contact.force_W.head<2>().norm(), tool_.friction * contact.force_W.z() + 1e-9);
    }
    // The springs' equilibrium; the plate does not turn, as all is symmetric.
    tool_.tool.X_WT =
        RigidPose(tool_.device.X_WT.translation() + force_.cwiseQuotient(tool_.coupling.stiffness));
    return report;
  }

  const Vector3& force() const { return force_; }
  Vector3 plate() const { return tool_.tool.X_WT.translation() - Vector3(2, 2, 3); }
  const SoftTissue& tissue() const { return tissue_; }
  std::size_t contacts() const { return places_.size(); }

 private:
  struct Place {
    std::size_t vertex;
    SurfacePoint surface;
    Vector3 on_plate;
  };

  static SoftTissueOptions options(Scalar period) {
    SoftTissueOptions options;
    options.material = {kBlockModulus, 0, 0.5, 0.5, 0.05};
    options.cube_edge = 1;
    options.period = period;
    options.fixed.emplace_back(Vector3(-1, -1, -1), Vector3(5, 5, 0.01));
    return options;
  }

  void add(std::size_t triangle, std::size_t corner) {
    const auto vertex = std::size_t(arrays_.triangles[triangle][corner]);
    if (arrays_.vertices[vertex].z() < 3 - 1e-9) return;
    for (const Place& place : places_) {
      if (place.vertex == vertex) return;
    }
    SurfacePoint surface{std::int32_t(triangle), {0, 0, 0}};
    surface.weights[corner] = 1;
    places_.push_back({vertex, surface, arrays_.vertices[vertex] - Vector3(2, 2, 3)});
  }

  testing::MeshArrays arrays_;
  SoftTissue tissue_;
  JointTool tool_;
  std::vector<Place> places_;
  Vector3 force_ = Vector3::Zero();
};

// Springs and column in series, whatever their ratio and the period.
TEST(JointStep, PressesLikeSpringsInSeries) {
  for (const Scalar ratio : {0.05, 1.0, 1000.0}) {
    for (const Scalar period : {0.1, 2.0}) {
      const Scalar block = PlateOnBlock::stiffness_of_block(), springs = ratio * block;
      PlateOnBlock scene(springs, period, 0);
      scene.press({0, 0, -0.1});
      for (int k = 0; k < 150; ++k) scene.step();
      const Scalar expected = 0.1 * springs * block / (springs + block);
      EXPECT_NEAR(scene.force().z(), expected, 0.01 * expected) << ratio << ' ' << period;
      EXPECT_NEAR(scene.force().head<2>().norm(), 0, 1e-6 * expected);
    }
  }
}

// No exchange of forces between steps: however stiff the springs, nothing swings up.
TEST(JointStep, ComesToRestForAnyStiffness) {
  for (const Scalar ratio : {1.0, 30.0, 1000.0}) {
    PlateOnBlock scene(ratio * PlateOnBlock::stiffness_of_block(), 0.05, kPlateFriction);
    scene.press({0.02, 0.01, -0.1});
    for (int k = 0; k < 300; ++k) scene.step();
    const Vector3 before = scene.force();
    for (int k = 0; k < 20; ++k) {
      scene.step();
      EXPECT_LE((scene.force() - before).norm(), 0.01 * before.norm()) << ratio;
    }
  }
}

TEST(JointStep, SticksInsideTheConeAndSlipsOnIt) {
  const Scalar springs = PlateOnBlock::stiffness_of_block();
  PlateOnBlock scene(springs, 0.1, kPlateFriction);
  scene.press({0, 0, -0.2});
  for (int k = 0; k < 200; ++k) scene.step();
  scene.press({0.01, 0, -0.2});
  for (int k = 0; k < 100; ++k) scene.step();
  const Scalar inside = scene.force().head<2>().norm() / scene.force().z();
  EXPECT_GT(inside, 0.01);
  EXPECT_LT(inside, 0.9 * kPlateFriction);
  for (int k = 0; k < 300; ++k) {
    scene.press({0.01 + 0.01 * k, 0, -0.2});
    scene.step();
  }
  EXPECT_NEAR(scene.force().head<2>().norm(), kPlateFriction * scene.force().z(),
              0.02 * kPlateFriction * scene.force().z());
  EXPECT_GT(scene.plate().x(), 1);
}

TEST(JointStep, ReleasesTheTissue) {
  PlateOnBlock scene(PlateOnBlock::stiffness_of_block(), 0.1, kPlateFriction);
  scene.press({0, 0, -0.3});
  for (int k = 0; k < 100; ++k) scene.step();
  EXPECT_GT(scene.tissue().balance().elastic_energy, 0);
  scene.press({0, 0, 1});
  for (int k = 0; k < 400; ++k) scene.step();
  EXPECT_EQ(scene.force(), Vector3(Vector3::Zero()));
  EXPECT_LE(scene.tissue().balance().elastic_energy, 1e-8);
}

TEST(JointStep, NamesWhatIsWrong) {
  const auto arrays = testing::divided_box({1, 1, 1}, {1, 1, 1});
  SoftTissueOptions options;
  options.material = {1, 0.3, 1, 0, 0};
  options.cube_edge = 0.5;
  options.period = 0.1;
  SoftTissue tissue(TriangleMesh(arrays.vertices, arrays.triangles), options);
  const auto message = [&](const auto& change) {
    JointTool tool;
    tool.coupling.stiffness.setConstant(1);
    tool.coupling.rotational_stiffness.setConstant(1);
    std::vector<ToolContactPoint> contacts(1);
    contacts[0].surface = SurfacePoint{};
    change(tool, contacts);
    return message_of([&] { step_jointly(tissue, tool, contacts); });
  };
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  has(message([](auto& tool, auto&) { tool.rest_offset = -1; }),
      "rest_offset must be finite and >= 0, not -1");
  has(message([](auto& tool, auto&) { tool.friction = std::nan(""); }),
      "friction must be finite and >= 0, not nan");
  has(message([](auto& tool, auto&) { tool.coupling.stiffness.y() = 0; }),
      "stiffness of a tool's springs must be finite and > 0, not 0");
  has(message([](auto& tool, auto&) { tool.coupling.rotational_stiffness.z() = -2; }),
      "rotational_stiffness of a tool's springs must be finite and > 0, not -2");
  has(message([](auto& tool, auto&) { tool.hinges.emplace_back(); }), "the hinges' stiffness");
  has(message([](auto&, auto& all) { all[0].surface->triangle = 12; }), "triangle 12 of 12");
  has(message([](auto&, auto& all) { all[0].nhat_W.setZero(); }), "contact 0 has numbers");
  has(message([](auto&, auto& all) { all[0].p_W.x() = kInfinity; }), "contact 0 has numbers");
  EXPECT_EQ(message([](auto&, auto& all) { all[0].surface = {}; }), "no error");
}

}  // namespace
}  // namespace dyop
