// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/scene_file.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "dyop/io/file_error.h"
#include "support/inputs/cube_files.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

using Json = nlohmann::ordered_json;

class SceneFile : public ::testing::Test {
 protected:
  SceneFile() { directory_.write("cube.obj", testing::cube_obj()); }

  // A small valid scene, to be damaged in one place.
  static Json valid() {
    return Json::parse(R"({
      "time": {"end": 1, "step": 0.1},
      "bodies": [
        {"name": "ball", "shape": {"sphere": {"radius": 0.5}}, "density": 2,
         "pose": {"position": [0, 0, 3]}, "velocity": {"linear": [1, 0, 0]}},
        {"name": "block", "kind": "static", "shape": {"mesh": "cube.obj"}}
      ]})");
  }

  Scene load(const std::string& text) const { return load_scene(directory_.write("s.json", text)); }

  std::string message_of_text(const std::string& text) const {
    try {
      load(text);
    } catch (const FileError& error) {
      const std::string file = (directory_.path() / "s.json").string();
      const std::string message = error.what();
      EXPECT_TRUE(message.starts_with(file)) << message;
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      return message.substr(std::min(file.size(), message.size()));
    }
    return "no error";
  }

  // The message after one change at a JSON pointer.
  std::string message_of(const std::string& pointer, const Json& value) const {
    Json scene = valid();
    scene[Json::json_pointer(pointer)] = value;
    return message_of_text(scene.dump());
  }

  std::string message_without(const std::string& object, const std::string& key) const {
    Json scene = valid();
    scene[Json::json_pointer(object)].erase(key);
    return message_of_text(scene.dump());
  }

  testing::TemporaryDirectory directory_;
};

TEST_F(SceneFile, ReadsLockedAxesAndJoints) {
  Json json = valid();
  json["bodies"][0]["locked"] = {{"translation", {true, false, false}}};
  json["joints"] = {{{"kind", "hinge"},
                     {"a", "block"},
                     {"b", "ball"},
                     {"point", {0, 0, 5}},
                     {"axis", {0, 2, 0}}}};
  const Scene scene = load(json.dump());
  EXPECT_EQ(scene.bodies[0].locked.translation, (std::array<bool, 3>{true, false, false}));
  EXPECT_EQ(scene.bodies[0].locked.rotation, (std::array<bool, 3>{false, false, false}));
  ASSERT_EQ(scene.joints.size(), 1u);
  EXPECT_EQ(scene.joints[0].kind, JointKind::Hinge);
  EXPECT_EQ(scene.joints[0].a, BodyId(1));
  EXPECT_EQ(scene.joints[0].X_BJ.translation(), Vector3(0, 0, 2));  // the ball is at z = 3
  EXPECT_NEAR((scene.joints[0].X_BJ.rotation().col(2) - Vector3::UnitY()).norm(), 0, 1e-12);
}

TEST_F(SceneFile, NamesWhatIsWrongWithJoints) {
  const auto message = [&](const char* key, const Json& value) {
    Json joint = {{"kind", "ball"}, {"a", "block"}, {"b", "ball"}, {"point", {0, 0, 5}}};
    joint[key] = value;
    return message_of("/joints", Json::array({joint}));
  };
  EXPECT_NE(message("b", "block").find("joints[0].b: expected another body"), std::string::npos);
  EXPECT_NE(message("kind", "rope").find("joints[0].kind: "), std::string::npos);
  EXPECT_NE(message("axis", {0, 0, 0}).find("joints[0].axis: "), std::string::npos);
  EXPECT_NE(message_of("/bodies/0/locked", {{"rotation", {true}}}).find("locked.rotation: "),
            std::string::npos);
}

TEST_F(SceneFile, ReadsASmallScene) {
  const Scene scene = load(valid().dump());
  ASSERT_EQ(scene.bodies.size(), 2u);
  EXPECT_EQ(scene.end_time, 1);
  EXPECT_EQ(scene.step, 0.1);
  const BodyDefinition& ball = scene.bodies[0];
  EXPECT_EQ(ball.name, "ball");
  EXPECT_EQ(ball.kind, BodyKind::Dynamic);
  EXPECT_EQ(ball.initial.X_WB.translation(), Vector3(0, 0, 3));
  EXPECT_EQ(ball.initial.twist.v_WB, Vector3(1, 0, 0));
  // Volume of a ball times density: 4/3 pi r^3 * 2 with r = 1/2.
  EXPECT_NEAR(ball.mass_properties.mass, 1.0471975511965976, 1e-12);
  EXPECT_EQ(scene.bodies[1].kind, BodyKind::Static);
  EXPECT_EQ(scene.shape_names[1], "mesh cube.obj, 12 triangles");
  EXPECT_EQ(scene.options.gravity_W, Vector3::Zero());
}

TEST_F(SceneFile, KeepsTheSourceSoThatItReadsBackTheSame) {
  const Scene scene = load(valid().dump(4));
  EXPECT_EQ(scene.source, valid().dump());
  EXPECT_EQ(load(scene.source).source, scene.source);
}

TEST_F(SceneFile, ReadsEveryShape) {
  Json json = valid();
  json["bodies"] = Json::parse(R"([
    {"name": "a", "mass": 1, "shape": {"box": {"half_extents": [1, 2, 3]}}},
    {"name": "b", "mass": 1, "shape": {"capsule": {"radius": 1, "half_length": 2}}},
    {"name": "c", "mass": 1, "shape": {"hull": {"points": [[0,0,0],[1,0,0],[0,1,0],[0,0,1]]}}},
    {"name": "d", "mass": 1, "shape": {"hull": {"mesh": "cube.obj", "scale": 2}}},
    {"name": "e", "mass": 1, "shape": {"mesh": "cube.obj", "scale": 2, "center": "mass"}},
    {"name": "f", "mass": 1, "shape": {"mesh": "cube.obj", "center": "bounds"}, "shell": true},
    {"name": "g", "mass": 1, "shape": {"mesh": "cube.obj", "scale": [1, 2, -3]}},
    {"name": "h", "mass": 1, "shape": {"sphere": {"radius": 1}, "scale": [1, 2, 3]}}])");
  const Scene scene = load(json.dump());
  EXPECT_EQ(dynamic_cast<const Box&>(*scene.bodies[0].shape).half_extents(), Vector3(1, 2, 3));
  EXPECT_EQ(dynamic_cast<const Capsule&>(*scene.bodies[1].shape).half_length(), 2);
  EXPECT_EQ(dynamic_cast<const ConvexHull&>(*scene.bodies[2].shape).vertices().size(), 4u);
  EXPECT_EQ(scene.bodies[3].shape->bounding_box().max(), Vector3(2, 2, 2));
  EXPECT_TRUE(scene.bodies[4].shape->bounding_box().max().isApprox(Vector3(1, 1, 1)));
  // A solid cube of mass m and edge s has the inertia m s^2 / 6, the shell of one m s^2 5 / 18.
  EXPECT_NEAR(scene.bodies[4].mass_properties.I_BBcm(0, 0), 4.0 / 6, 1e-12);
  EXPECT_NEAR(scene.bodies[5].mass_properties.I_BBcm(0, 0), 5.0 / 18, 1e-12);
  EXPECT_EQ(scene.bodies[6].shape->bounding_box().max(), Vector3(1, 2, 0));
  EXPECT_EQ(dynamic_cast<const Ellipsoid&>(*scene.bodies[7].shape).semi_axes(), Vector3(1, 2, 3));
  for (const BodyDefinition& body : scene.bodies) EXPECT_NEAR(body.mass_properties.mass, 1, 1e-12);
}

TEST_F(SceneFile, ReadsEveryOption) {
  Json json = valid();
  json.update(Json::parse(R"({
    "title": "T", "notes": "N", "target_distance": 0.25, "target_distances": [{"a": "ball", "b": "block", "distance": 0.5}],
    "filters": [["ball", "block"]], "policy": "stop", "rest_offset": 0.001,
    "integrator": {"kind": "cvode_bdf", "relative_tolerance": 0.01, "absolute_tolerance": 0.02,
                   "max_step": 0.5, "max_internal_steps": 7},
    "restitution_speed": 0.5, "sleep_steps": 3, "max_node_pairs": 11, "forces": {"gravity": [0, 0, -10]}})"));
  const Scene scene = load(json.dump());
  const WorldOptions& options = scene.options;
  EXPECT_EQ(scene.title, "T");
  EXPECT_EQ(options.target_distance, 0.25);
  ASSERT_EQ(scene.target_distances.size(), 1u);
  EXPECT_EQ(scene.target_distances[0].distance, 0.5);
  EXPECT_EQ(scene.disabled_pairs, (std::vector<std::pair<BodyId, BodyId>>{{BodyId(0), BodyId(1)}}));
  EXPECT_EQ(options.policy, ImpactPolicy::Stop);
  EXPECT_EQ(options.rest_offset, 0.001);
  EXPECT_EQ(options.integrator, IntegratorKind::CvodeBdf);
  EXPECT_EQ(options.integrator_options.relative_tolerance, 0.01);
  EXPECT_EQ(options.integrator_options.absolute_tolerance, 0.02);
  EXPECT_EQ(options.integrator_options.max_step, 0.5);
  EXPECT_EQ(options.integrator_options.max_internal_steps, 7);
  EXPECT_EQ(options.restitution_speed, 0.5);
  EXPECT_EQ(options.sleep_steps, 3);
  EXPECT_EQ(options.max_node_pairs, 11);
  EXPECT_EQ(options.gravity_W, Vector3(0, 0, -10));
}

// A point one unit along x from the origin B, which is the centre of mass, the body turned by
// nothing: the spring pulls it towards the anchor by k (A - P), the damper by -c v_P, v_P = v + w x
// (1, 0, 0).
TEST_F(SceneFile, AddsUpForces) {
  Json json = valid();
  json["forces"] = Json::parse(R"({
    "wrenches": [{"body": "ball", "force": [1, 0, 0], "torque": [0, 0, 5]}],
    "springs": [{"body": "ball", "point": [1, 0, 0], "anchor": [1, 2, 0], "stiffness": 10,
                 "damping": 3}],
    "drags": [{"body": "ball", "linear": 100, "angular": 1000}]})");
  const Scene scene = load(json.dump());
  const MotionState state{RigidPose(), {Vector3(0, 1, 0), Vector3(0, 0, 4)}};
  const Wrench wrench = scene.bodies[0].wrench(0, state);
  // v_P = (0, 1, 0) + (0, 4, 0); spring (0, 20, 0), damper (0, -15, 0), drag (0, -100, 0).
  EXPECT_TRUE(wrench.force.isApprox(Vector3(1, 20 - 15 - 100, 0)));
  EXPECT_TRUE(wrench.torque.isApprox(Vector3(0, 0, 5 + (20 - 15) - 1000 * 4)));
  EXPECT_FALSE(bool(scene.bodies[1].wrench));
}

TEST_F(SceneFile, ReadsSpringsBetweenBodies) {
  Json json = valid();
  json["forces"] = Json::parse(R"({"springs": [
    {"a": "block", "b": "ball", "point_a": [0, 0, 1], "stiffness": 10, "damping": 3},
    {"a": "ball", "b": "block", "rest_length": 2, "damping": 1}]})");
  const Scene scene = load(json.dump());
  ASSERT_EQ(scene.springs.size(), 2u);
  EXPECT_EQ(scene.springs[0].a, BodyId(1));
  EXPECT_EQ(scene.springs[0].p_AP, Vector3(0, 0, 1));
  EXPECT_EQ(scene.springs[0].stiffness, 10);
  EXPECT_EQ(scene.springs[0].damping, 3);
  EXPECT_FALSE(scene.springs[0].rest_length);
  EXPECT_EQ(scene.springs[1].rest_length, 2);
  const World world = make_world(scene);
  EXPECT_NEAR(world.spring_energy(), 0, 1e-12);
  EXPECT_EQ(*world.spring(SpringId{0}).rest_length, 2);  // from z = 1 to z = 3

  const auto message = [&](const Json& spring) {
    return message_of("/forces", {{"springs", Json::array({spring})}});
  };
  EXPECT_NE(message({{"a", "ball"}, {"b", "ball"}, {"stiffness", 1}}).find("springs[0].b: "),
            std::string::npos);
  EXPECT_NE(message({{"a", "ball"}, {"b", "block"}}).find("a stiffness or a damping"),
            std::string::npos);
  EXPECT_NE(message({{"a", "ball"}, {"b", "rope"}, {"stiffness", 1}}).find("springs[0].b: "),
            std::string::npos);
}

TEST_F(SceneFile, ReadsLimitsMotorsAndDistances) {
  Json json = valid();
  json["joints"] = Json::parse(R"([
    {"kind": "hinge", "a": "block", "b": "ball", "point": [0, 0, 5],
     "limits": {"min": -1, "max": 0.5}, "motor": {"speed": 2, "strength": 7}},
    {"kind": "distance", "a": "block", "b": "ball", "point_b": [0, 0, 1],
     "limits": {"min": 1, "max": 5}}])");
  const Scene scene = load(json.dump());
  ASSERT_EQ(scene.joints.size(), 2u);
  EXPECT_EQ(scene.joints[0].limits->min, -1);
  EXPECT_EQ(scene.joints[0].limits->max, 0.5);
  EXPECT_EQ(scene.joints[0].motor->speed, 2);
  EXPECT_EQ(scene.joints[0].motor->strength, 7);
  EXPECT_EQ(scene.joints[1].kind, JointKind::Distance);
  EXPECT_EQ(scene.joints[1].X_BJ.translation(), Vector3(0, 0, 1));
  EXPECT_EQ(scene.joints[1].limits->max, 5);
  make_world(scene);
}

TEST_F(SceneFile, ReadsWhatDrivesResistsAndCouplesJoints) {
  Json json = valid();
  json["joints"] = Json::parse(R"([
    {"name": "axle", "kind": "hinge", "a": "block", "b": "ball", "point": [0, 0, 5],
     "motor": {"position": 1, "stiffness": 50, "damping": 3}, "friction": 0.5,
     "break_force": 100, "break_torque": 20},
    {"kind": "ball", "a": "block", "b": "ball", "point": [0, 0, 5], "damping": 2,
     "swing_twist": {"swing": 0.5, "twist_min": -1, "twist_max": 2}},
    {"kind": "universal", "a": "block", "b": "ball", "point": [0, 0, 5], "axis": [0, 3, 0],
     "second_axis": [0, 0, 2]},
    {"name": "screw", "kind": "cylindrical", "a": "block", "b": "ball", "point": [0, 0, 5]},
    {"kind": "coupling", "first": "screw", "second": "axle", "ratio": -3}])");
  const Scene scene = load(json.dump());
  ASSERT_EQ(scene.joints.size(), 5u);
  const JointMotor& motor = *scene.joints[0].motor;
  EXPECT_EQ(motor.position, 1);
  EXPECT_EQ(motor.stiffness, 50);
  EXPECT_EQ(motor.damping, 3);
  EXPECT_EQ(motor.strength, kInfinity);
  EXPECT_EQ(scene.joints[0].friction, 0.5);
  EXPECT_EQ(scene.joints[0].break_force, 100);
  EXPECT_EQ(scene.joints[0].break_torque, 20);
  EXPECT_EQ(scene.joints[1].swing_twist->swing, 0.5);
  EXPECT_EQ(scene.joints[1].swing_twist->twist_max, 2);
  EXPECT_EQ(scene.joints[1].damping, 2);
  const Matrix3 R = scene.joints[2].X_AJ.rotation();
  EXPECT_LT((R.col(0) - Vector3::UnitY()).norm(), 1e-12);
  EXPECT_LT((R.col(1) - Vector3::UnitZ()).norm(), 1e-12);
  EXPECT_EQ(scene.joints[4].first, JointId{3});
  EXPECT_EQ(scene.joints[4].second, JointId{0});
  EXPECT_EQ(scene.joints[4].ratio, -3);
  EXPECT_EQ(make_world(scene).joints().size(), 5u);
  const auto message = [&](std::size_t k, const char* key, const Json& value) {
    Json changed = json;
    changed["joints"][k][key] = value;
    return message_of_text(changed.dump());
  };
  EXPECT_NE(message(0, "motor", Json::parse(R"({"position": 1})")).find("joints[0].motor"),
            std::string::npos)
      << message(0, "motor", Json::parse(R"({"position": 1})"));
  EXPECT_NE(message(0, "motor", {{"damping", 1}, {"position", 1}}).find("a motor has a position"),
            std::string::npos);
  EXPECT_NE(message(2, "second_axis", {0, 1, 1}).find("right angles"), std::string::npos);
  EXPECT_NE(message(3, "name", "axle").find("a name that no other joint has"), std::string::npos);
  EXPECT_NE(message(4, "second", "axel").find("the name of an earlier joint"), std::string::npos);
}

TEST_F(SceneFile, ReadsMaterialsAndSensors) {
  Json json = valid();
  json["separation_speed"] = 0.25;
  json["bodies"][0]["rolling_friction"] = 0.01;
  json["bodies"][0]["torsional_friction"] = 0.02;
  json["bodies"][1]["sensor"] = true;
  json["bodies"][1]["filter"] = {{"category", 4}, {"mask", 18446744073709551615U}, {"group", -2}};
  json["combine_friction"] = "product";
  json["combine_restitution"] = "maximum";
  json["materials"] =
      Json::array({{{"a", "ball"}, {"b", "block"}, {"restitution", 0.25}, {"friction", 0.75}}});
  const Scene scene = load(json.dump());
  EXPECT_EQ(scene.options.separation_speed, 0.25);
  EXPECT_EQ(scene.bodies[0].rolling_friction, 0.01);
  EXPECT_EQ(scene.bodies[0].torsional_friction, 0.02);
  EXPECT_TRUE(scene.bodies[1].is_sensor);
  EXPECT_EQ(scene.bodies[1].filter.category, 4U);
  EXPECT_EQ(scene.bodies[1].filter.mask, ~std::uint64_t{0});
  EXPECT_EQ(scene.bodies[1].filter.group, -2);
  EXPECT_EQ(scene.options.combine_friction, CombineRule::Product);
  EXPECT_EQ(scene.options.combine_restitution, CombineRule::Maximum);
  const World world = make_world(scene);
  EXPECT_EQ(world.pair_material(BodyId(0), BodyId(1)).friction, 0.75);
  EXPECT_EQ(world.pair_material(BodyId(0), BodyId(1)).restitution, 0.25);
  EXPECT_NE(message_of("/bodies/0/filter", {{"mask", -1}}).find("bodies[0].filter.mask: "),
            std::string::npos);
  EXPECT_NE(message_of("/combine_friction", "sum").find("combine_friction: "), std::string::npos);
}

TEST_F(SceneFile, ReadsAKinematicBody) {
  Json json = valid();
  json["bodies"][1] = Json::parse(R"({"name": "arm", "kind": "kinematic",
    "shape": {"box": {"half_extents": [1, 1, 1]}},
    "motion": {"kind": "interpolated", "interval": [0, 1], "from": {}, "to": {"position": [1, 0, 0]}}})");
  EXPECT_TRUE(load(json.dump()).bodies[1].motion->pose(1).translation().isApprox(Vector3(1, 0, 0)));
  json["time"]["end"] = 2;
  EXPECT_NE(message_of_text(json.dump()).find(": bodies[1].motion: "), std::string::npos);
}

TEST_F(SceneFile, ReadsOctreesAndPointClouds) {
  // Two bits a child: the root's child 7, above zero along all axes, is occupied.
  const std::string octree = std::string("# Octomap OcTree binary file\nid OcTree\nsize 2\n") +
                             "res 0.5\ndata\n" + std::string("\0\x80", 2);
  directory_.write("map.bt", octree);
  Json json = valid();
  json["bodies"][1]["shape"] = {{"octree", "map.bt"}};
  const Scene scene = load(json.dump());
  EXPECT_EQ(scene.shape_names[1], "octree map.bt, 1 cubes");
  EXPECT_NEAR(scene.bodies[1].shape->bounding_box().max().x(), 0.5 * 32768, 1e-9);
  json["bodies"][1]["shape"] = {{"octree", "none.bt"}};
  EXPECT_NE(message_of_text(json.dump()).find("shape.octree: no octree file none.bt in "),
            std::string::npos);
  json["bodies"][1]["shape"] = {{"octree", "cube.obj"}};
  EXPECT_NE(message_of_text(json.dump()).find("shape.octree: "), std::string::npos);
  json["bodies"][1]["shape"] =
      Json::parse(R"({"point_cloud": {"points": [[0, 0, 0], [1, 2, 3]], "radius": 0.25}})");
  const auto cloud = load(json.dump()).bodies[1].shape;
  EXPECT_EQ(dynamic_cast<const CompoundShape&>(*cloud).children().size(), 2u);
  EXPECT_NEAR(cloud->bounding_box().max().z(), 3.25, 1e-12);
  EXPECT_NE(message_of("/bodies/1/shape", Json::parse(R"({"point_cloud": {"points": []}})"))
                .find("bodies[1].shape.point_cloud.points: "),
            std::string::npos);
}

TEST_F(SceneFile, LooksForMeshesInTheGivenDirectories) {
  const testing::TemporaryDirectory other;
  other.write("far.obj", testing::cube_obj());
  Json json = valid();
  json["bodies"][1]["shape"]["mesh"] = "far.obj";
  const std::filesystem::path file = directory_.write("s.json", json.dump());
  EXPECT_EQ(load_scene(file, {other.path()}).bodies.size(), 2u);
  EXPECT_EQ(message_of_text(json.dump()),
            ": bodies[1].shape.mesh: no mesh file far.obj in " + directory_.path().string());
  json["bodies"][1]["shape"]["mesh"] = (other.path() / "far.obj").string();
  EXPECT_EQ(load(json.dump()).bodies.size(), 2u);
}

TEST_F(SceneFile, NamesTheKeyAndTheValueThatAreWrong) {
  EXPECT_EQ(message_of("/bodies/0/shape/sphere/radius", -1),
            ": bodies[0].shape.sphere.radius: radius must be > 0 and at most 1e+60, not -1");
  EXPECT_EQ(message_of("/bodies/0/shape/sphere/radius", "big"),
            ": bodies[0].shape.sphere.radius: expected a number, found \"big\"");
  EXPECT_EQ(message_of("/bodies/0/density", 0),
            ": bodies[0].density: expected a number > 0, found 0");
  EXPECT_EQ(message_of("/bodies/0/pose/position", Json::array({1, 2})),
            ": bodies[0].pose.position: expected three numbers [x, y, z], found [1,2]");
  EXPECT_EQ(message_of("/bodies/0/kind", "flying"),
            ": bodies[0].kind: expected one of dynamic, kinematic, static, found \"flying\"");
  EXPECT_EQ(message_of("/bodies/0/restitution", 1.5),
            ": bodies[0].restitution: expected a number from 0 to 1, found 1.5");
  EXPECT_EQ(message_of("/bodies/1/name", "ball"),
            ": bodies[1].name: expected a name that no other body has, found \"ball\"");
  EXPECT_EQ(message_of("/bodies/1/shell", 1), ": bodies[1].shell: expected true or false, found 1");
  EXPECT_EQ(message_of("/bodies", Json::array()),
            ": bodies: expected at least 1 elements, found 0");
  EXPECT_EQ(message_of("/time/end", -1), ": time.end: expected a number > 0, found -1");
  EXPECT_EQ(
      message_of("/time/step", 1e-12),
      ": time.step: expected a step of at least one part in 1e9 of the end time, found 1e-12");
  EXPECT_EQ(message_of("/policy", "bounce"),
            ": policy: expected one of stop, impulse, found \"bounce\"");
  EXPECT_EQ(message_of("/max_node_pairs", 0.5),
            ": max_node_pairs: expected an integer > 0, found 0.5");
  EXPECT_EQ(message_of("/sleep_steps", 3e9),
            ": sleep_steps: expected an integer > 0, found 3000000000.0");
  EXPECT_EQ(message_of("/sleep_steps", 3000000000),
            ": sleep_steps: expected an integer below 2^31, found 3000000000");
}

TEST_F(SceneFile, NamesKeysThatAreUnknownMissingOrMisplaced) {
  EXPECT_NE(message_of("/gravity", 1).find(": unknown key 'gravity'; known keys are title"),
            std::string::npos);
  EXPECT_NE(
      message_of("/bodies/0/shap", 1).find(": bodies[0]: unknown key 'shap'; known keys are name"),
      std::string::npos);
  EXPECT_EQ(message_without("/bodies/0", "name"), ": bodies[0]: the key 'name' is missing");
  EXPECT_EQ(message_without("/bodies/0", "shape"), ": bodies[0]: the key 'shape' is missing");
  EXPECT_EQ(message_without("/bodies/0", "density"),
            ": bodies[0]: a dynamic body needs either density or mass");
  EXPECT_EQ(message_of("/bodies/0/mass", 1),
            ": bodies[0]: a dynamic body needs either density or mass");
  EXPECT_EQ(message_without("", "time"), ": the key 'time' is missing");
  EXPECT_EQ(message_of("/bodies/1/density", 1),
            ": bodies[1].density: only a dynamic body can have this key");
  EXPECT_EQ(message_of("/bodies/0/motion", Json::object()),
            ": bodies[0].motion: only a kinematic body can have a motion");
  EXPECT_EQ(message_of("/bodies/0/shape/center", "mass"),
            ": bodies[0].shape.center: only a mesh can have this key");
  EXPECT_EQ(message_of("/bodies/0/shape/scale", 0),
            ": bodies[0].shape.scale: scale factors must be finite and not zero, not (0 0 0)");
  EXPECT_EQ(message_of("/bodies/0/shape/scale", "big"),
            ": bodies[0].shape.scale: expected a number, found \"big\"");
  EXPECT_EQ(
      message_of("/bodies/0/shape/box", Json::object()),
      ": bodies[0].shape: expected exactly one of mesh, hull, sphere, box, capsule, cylinder, "
      "cone, ellipsoid, rounded_box, rounded_cylinder, tapered_capsule, half_space, "
      "octree, point_cloud, found 2");
  EXPECT_EQ(
      message_of("/bodies/0/shape", Json::object()),
      ": bodies[0].shape: expected exactly one of mesh, hull, sphere, box, capsule, cylinder, "
      "cone, ellipsoid, rounded_box, rounded_cylinder, tapered_capsule, half_space, "
      "octree, point_cloud, found 0");
}

TEST_F(SceneFile, NamesReferencesToBodiesThatAreWrong) {
  EXPECT_EQ(message_of("/filters", Json::parse(R"([["ball", "bell"]])")),
            ": filters[0][1]: expected the name of a body, found \"bell\"");
  EXPECT_EQ(message_of("/target_distances",
                       Json::parse(R"([{"a": "ball", "b": "ball", "distance": 1}])")),
            ": target_distances[0].b: expected a body other than a, found \"ball\"");
  EXPECT_EQ(message_of("/forces", Json::parse(R"({"drags": [{"body": "block", "linear": 1}]})")),
            ": forces.drags[0].body: expected a dynamic body: forces do not move others, found "
            "\"block\"");
}

TEST_F(SceneFile, PassesOnWhatTheLibraryRefuses) {
  EXPECT_NE(message_of("/bodies/0/pose", Json{{"quaternion", {1, 1, 0, 0}}})
                .find(": bodies[0].pose.quaternion: pose rotation must be a unit quaternion"),
            std::string::npos);
  EXPECT_NE(message_of("/bodies/0/shape", Json{{"box", {{"half_extents", {1, -1, 1}}}}})
                .find(": bodies[0].shape.box.half_extents: "),
            std::string::npos);
}

TEST_F(SceneFile, NamesTheMeshThatIsWrong) {
  directory_.write("broken.obj", "v 0 0 nan\n");
  EXPECT_NE(message_of("/bodies/1/shape/mesh", "broken.obj")
                .find("broken.obj:1: vertex z: expected a finite number, found 'nan'"),
            std::string::npos);
  directory_.write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_NE(message_of("/bodies/0/shape", Json{{"mesh", "open.obj"}})
                .find(": bodies[0].shape: the mesh is not closed, so it has no volume"),
            std::string::npos);
}

TEST_F(SceneFile, NamesLineAndColumnOfASyntaxError) {
  EXPECT_EQ(message_of_text("{\n  \"time\": 1,\n  \"bodies\" 2\n}").substr(0, 7), ":3:12: ");
  EXPECT_EQ(message_of_text("").substr(0, 6), ":1:1: ");
  EXPECT_EQ(message_of_text("{\"a\": 1, \"a\": 2}"), ": the key 'a' occurs twice in one object");
  EXPECT_NE(message_of_text("{\"time\": 1e999}").find("number overflow"), std::string::npos);
  EXPECT_NE(message_of_text("{\"title\": \"\xff\"}").find("invalid string"), std::string::npos);
}

TEST_F(SceneFile, IsMissing) {
  EXPECT_THROW(load_scene(directory_.path() / "none.json"), FileError);
}

TEST_F(SceneFile, MakesAWorld) {
  const Scene scene = load(valid().dump());
  const World world = make_world(scene);
  EXPECT_EQ(world.body_count(), 2u);
  EXPECT_EQ(world.body(BodyId(0)).name, "ball");
}

}  // namespace
}  // namespace dyop
