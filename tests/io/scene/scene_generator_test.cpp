// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/io/scene_file.h"
#include "support/temporary_directory.h"
#include "support/world_energy.h"

namespace dyop {
namespace {

class SceneGenerator : public ::testing::TestWithParam<SceneKind> {
 protected:
  Scene make(int n) const {
    const std::filesystem::path file = directory_.path() / "scene.json";
    write_generated_scene(generate_scene(GetParam().name, n), file);
    return load_scene(file);
  }

  testing::TemporaryDirectory directory_;
};

bool is_disabled(const Scene& scene, const BodyId& a, const BodyId& b) {
  for (const JointDefinition& joint : scene.joints) {
    if ((joint.a == a && joint.b == b) || (joint.a == b && joint.b == a)) return true;
  }
  return false;
}

TEST_P(SceneGenerator, KeepsBodiesApartAtTheStart) {
  const Scene scene = make(std::max(3, GetParam().least));
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    for (std::size_t a = 0; a < b; ++a) {
      const BodyDefinition &body_a = scene.bodies[a], &body_b = scene.bodies[b];
      const bool is_fixed = body_a.kind == BodyKind::Static && body_b.kind == BodyKind::Static;
      if (is_fixed || is_disabled(scene, BodyId(a), BodyId(b))) continue;
      const Scalar lower =
          distance(*body_a.shape, body_a.initial.X_WB, *body_b.shape, body_b.initial.X_WB).lower;
      EXPECT_GE(lower, *scene.options.target_distance) << body_a.name << ", " << body_b.name;
    }
  }
}

TEST_P(SceneGenerator, StepsWithoutAFault) {
  const Scene scene = make(std::max(3, GetParam().least));
  World world = make_world(scene);
  for (int k = 0; k < 20; ++k) {
    const AdvanceReport report = world.advance(scene.step);
    ASSERT_EQ(report.status, AdvanceStatus::Completed) << "step " << k;
    EXPECT_TRUE(report.too_near.empty()) << "step " << k;
  }
}

TEST_P(SceneGenerator, TakesTheNumbersThatItSays) {
  const SceneKind kind = GetParam();
  EXPECT_FALSE(generate_scene(kind.name, kind.least).text.empty());
  EXPECT_THROW(generate_scene(kind.name, kind.least - 1), InvalidArgument);
  EXPECT_THROW(generate_scene(kind.name, kind.most + 1), InvalidArgument);
}

TEST_P(SceneGenerator, MakesTheSameTextAgain) {
  EXPECT_EQ(generate_scene(GetParam().name, 4).text, generate_scene(GetParam().name, 4).text);
}

INSTANTIATE_TEST_SUITE_P(Kinds, SceneGenerator, ::testing::ValuesIn(scene_kinds()),
                         [](const auto& instance) {
                           std::string name = instance.param.name;
                           std::erase(name, '-');
                           return name;
                         });

// Arches and card houses that are built at their rest gaps stand, at any step, with every contact
// solved to a residual far below 1e-6; and then they sleep.
class StandingScene : public ::testing::TestWithParam<std::tuple<const char*, int, Scalar>> {};

TEST_P(StandingScene, StandsStrictlySolved) {
  const auto [kind, n, h] = GetParam();
  const testing::TemporaryDirectory directory;
  const std::filesystem::path file = directory.path() / "scene.json";
  write_generated_scene(generate_scene(kind, n), file);
  Scene scene = load_scene(file);
  scene.options.records_motions = false;
  World world = make_world(scene);
  const std::size_t count = world.bodies().size() - 1;  // without the floor
  std::size_t asleep = 0;
  for (int k = 0; k < 60; ++k) {
    const AdvanceReport report = world.advance(h);
    ASSERT_EQ(report.status, AdvanceStatus::Completed);
    ASSERT_EQ(report.work.unconverged, 0);
    ASSERT_EQ(report.work.stalls, 0);
    ASSERT_LT(report.work.residual, 1e-8);
    asleep += report.fell_asleep.size();
  }
  EXPECT_EQ(asleep, count);
  for (const BodyId id : world.bodies()) {
    const RigidPose& before = scene.bodies[id.slot].initial.X_WB;
    const RigidPose after = world.state(id).X_WB;
    const Scalar radius = world.body(id).shape->bounding_radius();
    EXPECT_LT((after.translation() - before.translation()).norm(), 1e-6 * radius) << id.slot;
    EXPECT_LT((after.rotation() - before.rotation()).norm(), 1e-6) << id.slot;
  }
}

INSTANTIATE_TEST_SUITE_P(
    ArchesAndCards, StandingScene,
    ::testing::Values(std::tuple{"arch", 25, 0.01}, std::tuple{"arch", 101, 0.0025},
                      std::tuple{"arch", 101, 0.01}, std::tuple{"cards", 4, 0.0025},
                      std::tuple{"cards", 4, 0.01}, std::tuple{"cards", 10, 0.01}),
    [](const auto& test) {
      return std::string(std::get<0>(test.param)) + std::to_string(std::get<1>(test.param)) + "at" +
             std::to_string(std::lround(1e6 * std::get<2>(test.param))) + "us";
    });

// A wall that is struck is solved coarsely, in short substeps: it gains no energy by that, takes up
// the momentum that the ball loses, and no island gets stuck.
TEST(StruckWall, GainsNoEnergyAndTakesTheBallsMomentum) {
  const testing::TemporaryDirectory directory;
  const std::filesystem::path file = directory.path() / "scene.json";
  write_generated_scene(generate_scene("wall", 4), file);
  Scene scene = load_scene(file);
  scene.options.records_motions = false;
  World world = make_world(scene);
  const BodyId ball = world.bodies().back();
  ASSERT_EQ(world.body(ball).name, "ball");
  const Scalar begin = world.kinetic_energy();
  Scalar before = testing::energy(world, scene.options.gravity_W);
  for (int k = 0; k < 60; ++k) {
    const AdvanceReport report = world.advance(0.01);
    ASSERT_EQ(report.status, AdvanceStatus::Completed);
    ASSERT_EQ(report.work.stalls, 0);
    const Scalar after = testing::energy(world, scene.options.gravity_W);
    EXPECT_LT(after - before, 1e-3 * begin) << "at " << world.time();
    before = after;
  }
  const Scalar mass = world.body(ball).mass_properties.mass;
  Scalar momentum = 0;  // of the bricks, across the wall
  for (const BodyId id : world.bodies()) {
    if (id == ball || world.body(id).kind != BodyKind::Dynamic) continue;
    momentum += world.body(id).mass_properties.mass * world.state(id).twist.v_WB.y();
  }
  const Scalar lost = mass * (12 - world.state(ball).twist.v_WB.y());
  EXPECT_GT(momentum, 0);
  EXPECT_LT(momentum, 1.001 * lost);  // the floor takes some by friction
}

TEST(SceneGeneratorArguments, NamesTheUnknownKind) {
  try {
    generate_scene("heap", 3);
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_NE(std::string(error.what()).find("'heap'"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace dyop
