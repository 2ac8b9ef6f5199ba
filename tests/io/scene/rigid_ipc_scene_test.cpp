// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "dyop/geometry/triangle_mesh.h"
#include "dyop/io/file_error.h"
#include "dyop/io/mesh_file.h"
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
  expect({{"mesh", "cube.obj"}, {"scale", {1, 0, 1}}}, ".scale: ");
  expect({{"mesh", "cube.obj"}, {"is_dof_fixed", {true, false}}}, ".is_dof_fixed: ");
  expect({{"vertices", {{0, 0, 0}, {1, 0, 0}}}, {"edges", {{0, 2}}}}, ".edges[0][1]: ");
  expect({{"vertices", {{0, 0, 0}, {1, 0, 0}}}, {"faces", {{0, 1}}}}, ".faces[0]: ");
  expect({{"vertices", {{0, 0}, {1, 0}}}}, ".vertices[0]: ");
  EXPECT_NE(message_of({{"density", 1}}).find("mesh"), std::string::npos);
  expect({{"mesh", "cube.obj"}, {"type", "kinematic"}, {"kinematic_poses", {{{"position", 1}}}}},
         ".kinematic_poses[0].position: ");
}

TEST_F(RigidIpcScene, MirrorsMeshes) {
  const Json block = {{"mesh", "cube.obj"}, {"scale", {-2, 1, 1}}, {"position", {3, 0, 0}}};
  const BodyDefinition body = load(Json::array({block})).bodies[0];
  const auto& mesh = dynamic_cast<const TriangleMesh&>(*body.shape);
  EXPECT_TRUE(mesh.is_closed());
  EXPECT_NEAR(body.mass_properties.mass, 2000, 1e-9);
  const TriangleMesh cube = load_mesh(directory_.path() / "meshes/cube.obj");
  for (std::size_t k = 0; k < cube.vertices().size(); ++k) {
    EXPECT_EQ(mesh.vertices()[k], cube.vertices()[k].cwiseProduct(Vector3(-2, 1, 1)));
  }
}

TEST_F(RigidIpcScene, ReadsBodiesOfVerticesEdgesAndFaces) {
  const Json fin = {{"vertices", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 3}, {2, 2, 2}}},
                    {"faces", {{0, 1, 2}}},
                    {"edges", {{0, 1}, {2, 1}, {0, 3}}}};
  const Json wire = {{"vertices", {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}}}, {"edges", {{0, 1}, {1, 2}}}};
  const Json point = {{"vertices", {{1, 2, 3}}}, {"linear_velocity", {1, 0, 0}}};
  const Scene scene = load({fin, wire, point});
  ASSERT_EQ(scene.bodies.size(), 3u);
  EXPECT_EQ(scene.bodies[0].name, "body 0");
  const auto triangles = [&](std::size_t k) {
    const auto& mesh = dynamic_cast<const TriangleMesh&>(*scene.bodies[k].shape);
    return std::vector(mesh.triangles().begin(), mesh.triangles().end());
  };
  EXPECT_EQ(triangles(0), (std::vector<TriangleIndices>{{0, 1, 2}, {0, 3, 3}, {4, 4, 4}}));
  EXPECT_EQ(triangles(1), (std::vector<TriangleIndices>{{0, 1, 1}, {1, 2, 2}}));
  EXPECT_NEAR(scene.bodies[0].mass_properties.mass, 500, 1e-9);
  EXPECT_NEAR(scene.bodies[1].mass_properties.mass, 3000, 1e-9);
  EXPECT_EQ(scene.bodies[2].mass_properties.mass, 1000);
  EXPECT_EQ(scene.bodies[2].mass_properties.p_BoBcm, Vector3(1, 2, 3));
  World world = make_world(scene);
  EXPECT_EQ(world.advance(0.5).status, AdvanceStatus::Completed);
  EXPECT_NEAR(world.state(BodyId(2)).X_WB.translation().x(), 0.5, 1e-12);
}

TEST_F(RigidIpcScene, AFileOfVerticesIsACloudOfPoints) {
  directory_.write("meshes/cloud.obj", "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\n");
  const BodyDefinition body =
      load(Json::array({{{"mesh", "cloud.obj"}, {"density", 1}}})).bodies[0];
  EXPECT_EQ(dynamic_cast<const TriangleMesh&>(*body.shape).triangles().size(), 4u);
  EXPECT_EQ(body.mass_properties.mass, 4);
  EXPECT_EQ(body.mass_properties.p_BoBcm, Vector3(0.25, 0.5, 0.75));
}

TEST_F(RigidIpcScene, WiresFallAndRest) {
  directory_.write("meshes/ring.obj",
                   "v 1 0 0\nv 0.5 0 0.9\nv -0.5 0 0.9\nv -1 0 0\nv -0.5 0 -0.9\nv 0.5 0 -0.9\n"
                   "l 1 2 3 4 5 6 1\n");
  Json bodies = Json::array({{{"mesh", "cube.obj"},
                              {"scale", {20, 1, 20}},
                              {"type", "static"},
                              {"position", {-10, -1, -10}}}});
  for (int k = 0; k < 3; ++k) {
    bodies.push_back({{"mesh", "ring.obj"},
                      {"position", {0.3 * k, 0.4 + 0.5 * k, 0.1 * k}},
                      {"rotation", {20, 0, 10 * k}}});
  }
  const Scene scene = load(bodies, "coefficient_friction", 0.5);
  World world = make_world(scene);
  for (int k = 0; k < 6; ++k) EXPECT_EQ(world.advance(0.5).status, AdvanceStatus::Completed);
  EXPECT_LT(world.kinetic_energy(), 1e-3);
  for (std::size_t k = 1; k < 4; ++k) {
    const Scalar height = world.state(BodyId(k)).X_WB.translation().y();
    EXPECT_GT(height, 0) << k;
    EXPECT_LT(height, 0.3) << k;
  }
}

TEST_F(RigidIpcScene, KinematicBodiesStopAndFollowPoses) {
  const Json common = {{"mesh", "cube.obj"},
                       {"type", "kinematic"},
                       {"scale", {1, 2, 3}},
                       {"rotation", {10, 20, 30}},
                       {"linear_velocity", {0, 2, 0}}};
  Json stops = common;
  stops["kinematic_max_time"] = 0.5;
  Json follows = common;
  follows["position"] = {5, 0, 0};
  const Matrix3 R = load(Json::array({common})).bodies[0].initial.X_WB.rotation();
  // Moments of inertia grow from z to x: a pose says where these axes are.
  Matrix3 axes;
  axes << R.col(2), R.col(1), -R.col(0);
  const Vector3 turn = rotation_vector(axes);
  const Json rotation = {turn.x(), turn.y(), turn.z()};
  follows["kinematic_poses"] = {{{"position", {5, 0.1, 0}}, {"rotation", rotation}},
                                {{"position", {5, 0.3, 0}}, {"rotation", rotation}}};
  const Scene scene = load({stops, follows});
  const Motion& stopping = *scene.bodies[0].motion;
  EXPECT_NEAR(stopping.pose(0.25).translation().y(), 0.5, 1e-12);
  EXPECT_NEAR(stopping.pose(2).translation().y(), 1, 1e-12);
  // Poses are of the centre of mass.
  const Motion& following = *scene.bodies[1].motion;
  const Vector3 center = scene.bodies[1].mass_properties.p_BoBcm;
  EXPECT_NEAR((following.pose(0.025) * center).y(), 0.1, 1e-12);
  EXPECT_NEAR((following.pose(0.05) * center).y(), 0.3, 1e-12);
  EXPECT_NEAR((following.pose(0.1) * center).y(), 0.7, 1e-9);  // as in the last step
  for (const Scalar t : {0.0, 0.025, 0.04, 1.0}) {
    EXPECT_LT((following.pose(t).rotation() - R).norm(), 1e-9) << t;
  }
}

TEST_F(RigidIpcScene, SplitsMeshesIntoTheirParts) {
  const TriangleMesh cube = load_mesh(directory_.path() / "meshes/cube.obj");
  std::ostringstream obj;
  for (int k = 0; k < 2; ++k) {
    for (const Vector3& v : cube.vertices()) {
      obj << "v " << v.x() + 3 * k << ' ' << v.y() << ' ' << v.z() << '\n';
    }
  }
  for (int k = 0; k < 2; ++k) {
    for (const TriangleIndices& t : cube.triangles()) {
      obj << "f";
      for (const std::int32_t v : t) obj << ' ' << v + 1 + 8 * k;
      obj << '\n';
    }
  }
  directory_.write("meshes/two.obj", obj.str());
  const Scene whole = load(Json::array({{{"mesh", "two.obj"}}}));
  EXPECT_EQ(whole.bodies.size(), 1u);
  const Scene scene = load(Json::array({{{"mesh", "two.obj"}, {"split_components", true}}}));
  ASSERT_EQ(scene.bodies.size(), 2u);
  EXPECT_EQ(scene.bodies[1].name, "two 0 part 1");
  EXPECT_NEAR(scene.bodies[1].mass_properties.mass, 1000, 1e-9);
  EXPECT_LT((scene.bodies[1].mass_properties.p_BoBcm - Vector3(3.5, 0.5, 0.5)).norm(), 1e-12);
}

TEST_F(RigidIpcScene, IgnoresCommentsAndKeysOfOtherSolvers) {
  EXPECT_EQ(message_of({{"mesh", "cube.obj"}, {"#type", "soft"}, {"ipc_comparison_enabled", true}}),
            "no error");
}

}  // namespace
}  // namespace dyop
