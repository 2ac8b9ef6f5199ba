// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/scene_io/scene_generator.h"

#include <gtest/gtest.h>

#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/scene_io/scene_file.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

class SceneGenerator : public ::testing::TestWithParam<SceneKind> {
 protected:
  Scene make(int n) const {
    const std::filesystem::path file = directory_.path() / "scene.json";
    write_generated_scene(generate_scene(GetParam().name, n), file);
    return load_scene(file);
  }

  test::TemporaryDirectory directory_;
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
