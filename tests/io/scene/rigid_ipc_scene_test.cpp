// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <numbers>

#include "dyop/io/file_error.h"
#include "dyop/io/scene_file.h"
#include "support/inputs/cube_files.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

using Json = nlohmann::ordered_json;

// A scene with its meshes in the folder `meshes` beside that of the scene.
class RigidIpcScene : public ::testing::Test {
 protected:
  RigidIpcScene() {
    std::filesystem::create_directory(directory_.path() / "meshes");
    std::filesystem::create_directory(directory_.path() / "scenes");
    directory_.write("meshes/cube.obj", testing::cube_obj());
  }
  Scene load(const Json& bodies, const std::string& problem_key = "#",
             const Json& value = 0) const {
    Json scene;
    scene["timestep"] = 0.025;
    scene["max_time"] = 3;
    scene["ipc_solver"] = {{"velocity_conv_tol", 1}};
    Json& problem = scene["rigid_body_problem"];
    problem["gravity"] = {0, -9.8, 0};
    problem["rigid_bodies"] = bodies;
    problem[problem_key] = value;
    return load_scene(directory_.write("scenes/s.json", scene.dump()));
  }
  std::string message_of(const Json& body) const {
    try {
      load(Json::array({body}));
    } catch (const FileError& error) {
      return error.what();
    }
    return "no error";
  }

  testing::TemporaryDirectory directory_;
};

TEST_F(RigidIpcScene, ReadsWhatAllBodiesShare) {
  const Scene scene = load({{{"mesh", "cube.obj"}}, {{"mesh", "cube.obj"}, {"enabled", false}}},
                           "coefficient_friction", 0.25);
  EXPECT_EQ(scene.step, 0.025);
  EXPECT_EQ(scene.end_time, 3);
  EXPECT_EQ(scene.options.gravity_W, Vector3(0, -9.8, 0));
  ASSERT_EQ(scene.bodies.size(), 1u);
  EXPECT_EQ(scene.bodies[0].friction, 0.25);
  EXPECT_EQ(scene.bodies[0].restitution, 0);
  EXPECT_EQ(load({{{"mesh", "cube.obj"}}}, "coefficient_restitution", -1).bodies[0].restitution, 0);
  EXPECT_EQ(load({{{"mesh", "cube.obj"}}}, "coefficient_restitution", 0.5).bodies[0].restitution,
            0.5);
}

TEST_F(RigidIpcScene, ReadsPoseScaleAndDensity) {
  const Scene one = load({{{"mesh", "cube.obj"}}});
  const Scene other = load({{{"mesh", "cube.obj"},
                             {"scale", {2, 3, 1}},
                             {"density", 500},
                             {"position", {1, 2, 3}},
                             {"rotation", {90, 90, 0}}}});
  EXPECT_NEAR(other.bodies[0].mass_properties.mass, 3 * one.bodies[0].mass_properties.mass, 1e-9);
  const RigidPose& X_WB = other.bodies[0].initial.X_WB;
  EXPECT_EQ(X_WB.translation(), Vector3(1, 2, 3));
  // About x first: y becomes z; then about y: z becomes x.
  EXPECT_NEAR((X_WB.rotation() * Vector3::UnitY() - Vector3::UnitX()).norm(), 0, 1e-12);
}

TEST_F(RigidIpcScene, ReadsKindsAndLockedAxes) {
  const Json some = {true, false, true, false, true, false};
  const Scene scene = load({{{"mesh", "cube.obj"}, {"is_dof_fixed", true}},
                            {{"mesh", "cube.obj"}, {"type", "static"}},
                            {{"mesh", "cube.obj"}, {"is_dof_fixed", some}},
                            {{"mesh", "cube.obj"},
                             {"type", "kinematic"},
                             {"linear_velocity", {1, 0, 0}},
                             {"angular_velocity", {0, 0, 90}}}});
  EXPECT_EQ(scene.bodies[0].kind, BodyKind::Static);
  EXPECT_EQ(scene.bodies[1].kind, BodyKind::Static);
  EXPECT_EQ(scene.bodies[2].kind, BodyKind::Dynamic);
  EXPECT_EQ(scene.bodies[2].locked.translation, (std::array<bool, 3>{true, false, true}));
  EXPECT_EQ(scene.bodies[2].locked.rotation, (std::array<bool, 3>{false, true, false}));
  ASSERT_EQ(scene.bodies[3].kind, BodyKind::Kinematic);
  const Twist twist = scene.bodies[3].motion->twist(1);
  EXPECT_NEAR(twist.w_WB.z(), std::numbers::pi / 2, 1e-12);
}

TEST_F(RigidIpcScene, ReadsGroupsAndForces) {
  const Json body = {{"mesh", "cube.obj"}, {"group_id", 7}};
  const Scene scene = load({body, {{"mesh", "cube.obj"}, {"torque", {0, 300, 0}}}, body});
  ASSERT_EQ(scene.disabled_pairs.size(), 1u);
  EXPECT_EQ(scene.disabled_pairs[0], std::make_pair(BodyId(0), BodyId(2)));
  ASSERT_TRUE(scene.bodies[1].wrench);
  EXPECT_EQ(scene.bodies[1].wrench(0, {}).torque, Vector3(0, 300, 0));
  EXPECT_FALSE(scene.bodies[0].wrench);
}

TEST_F(RigidIpcScene, NamesWhatItCannotRead) {
  const std::string at = "rigid_body_problem.rigid_bodies[0]";
  const auto expect = [&](const Json& body, const std::string& part) {
    const std::string message = message_of(body);
    EXPECT_NE(message.find(at + part), std::string::npos) << message;
  };
  expect({{"mesh", "none.obj"}}, ".mesh: no mesh file none.obj");
  expect({{"mesh", "cube.obj"}, {"type", "soft"}}, ".type: ");
  expect({{"mesh", "cube.obj"}, {"scale", -1}}, ".scale: ");
  expect({{"mesh", "cube.obj"}, {"is_dof_fixed", {true, false}}}, ".is_dof_fixed: ");
  expect({{"mesh", "cube.obj"}, {"kinematic_poses", Json::array()}}, ".kinematic_poses: ");
}

TEST_F(RigidIpcScene, IgnoresCommentsAndKeysOfOtherSolvers) {
  EXPECT_EQ(message_of({{"mesh", "cube.obj"}, {"#type", "soft"}, {"ipc_comparison_enabled", true}}),
            "no error");
}

}  // namespace
}  // namespace dyop
