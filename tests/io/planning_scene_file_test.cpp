// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/planning_scene_file.h"

#include <gtest/gtest.h>

#include "dyop/chain/certify_chain.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/io/file_error.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

// An arm of length 1 with a ball at its end, on a base one unit above the root.
Robot make_swing() {
  std::vector<Link> links{{"root"}, {"base"}, {"arm"}};
  links[2].shape = std::make_shared<CompoundShape>(
      std::vector<CompoundChild>{{std::make_shared<Sphere>(0.1), RigidPose(Vector3(1, 0, 0))}});
  Joint stand;
  stand.name = "stand";
  stand.type = JointType::Fixed;
  stand.parent = "root";
  stand.child = "base";
  stand.X_PJ = RigidPose(Vector3(0, 0, 1));
  Joint turn;
  turn.name = "turn";
  turn.parent = "base";
  turn.child = "arm";
  return make_robot("arm", KinematicChain(links, {stand, turn}));
}

class PlanningSceneFile : public ::testing::Test {
 protected:
  PlanningScene load(const std::string& text, const std::string& name = "s.yaml") const {
    return load_planning_scene(directory_.write(name, text), robot_);
  }
  void expect_refused(const std::string& text, const std::string& part) const {
    try {
      load(text);
      ADD_FAILURE() << "no error; expected " << part;
    } catch (const FileError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  }
  // Turns the arm from 0 to 2 and tells where it first touches.
  ChainResult turn_among(const PlanningScene& scene) const {
    const Robot robot = scene.place(robot_);
    const std::vector<Scalar> times{0, 1};
    const std::vector<JointVector> ends{JointVector::Constant(1, 0), JointVector::Constant(1, 2)};
    return certify(*robot.chain, robot.expand(JointPath::linear(times, ends)), scene.obstacles());
  }

  testing::TemporaryDirectory directory_;
  Robot robot_ = make_swing();
};

constexpr const char* kScene = R"(
name: cell
robot_state:
  joint_state:
    name: [turn, some_wheel]
    position: [0.25, 9]
  attached_collision_objects:
    - link_name: arm
      object:
        header: {frame_id: arm}
        id: tool
        primitives:
          - {type: 4, dimensions: [0.2, 0.05]}
        primitive_poses:
          - position: {x: 1.07, y: 0, z: 0}
            orientation: {x: 0, y: 0, z: 0, w: 1}
      touch_links: [base]
allowed_collision_matrix:
  entry_names: [arm, post, base]
  entry_values:
    - [true, true, true]
    - [true, true, false]
    - [true, false, true]
fixed_frame_transforms:
  - child_frame_id: cell
    transform: {translation: [0, 0, 5], rotation: [0, 0, 0, 0]}
world:
  collision_objects:
    - id: post
      pose:
        position: [0, 0, 1]
        orientation: [0, 0, 0.70710678, 0.70710678]
      primitives:
        - type: cylinder
          dimensions: [2, 0.03]
      primitive_poses:
        - position: [1, 0, 0]
          orientation: [0, 0, 0, 1]
    - id: shelf
      header: {frame_id: cell}
      primitives:
        - type: box
          dimensions: [1, 2, 3]
        - type: sphere
          dimensions: [0.5]
      primitive_poses:
        - position: [4, 0, 0]
        - position: [5, 0, 0]
    - id: roof
      header: {frame_id: base}
      meshes:
        - vertices: [[0, 0, 0], {x: 1, y: 0, z: 0}, [0, 1, 0]]
          triangles: [{vertex_indices: [0, 1, 2]}]
      mesh_poses:
        - position: [0, 0, 8]
)";

TEST_F(PlanningSceneFile, ReadsObjectsInTheirFrames) {
  const PlanningScene scene = load(kScene);
  EXPECT_EQ(scene.name, "cell");
  ASSERT_EQ(scene.objects.size(), 3u);
  const auto& post = dynamic_cast<const Cylinder&>(*scene.objects[0].shape);
  EXPECT_EQ(post.radius(), 0.03);
  EXPECT_EQ(post.half_length(), 1);
  EXPECT_LT((scene.objects[0].X_WO.translation() - Vector3(0, 1, 1)).norm(), 1e-7);
  EXPECT_EQ(scene.objects[1].X_WO.translation(), Vector3(0, 0, 5));
  const AlignedBox shelf = scene.objects[1].shape->bounding_box();
  EXPECT_LT((shelf.min() - Vector3(3.5, -1, -1.5)).norm(), 1e-12);
  EXPECT_LT((shelf.max() - Vector3(5.5, 1, 1.5)).norm(), 1e-12);
  EXPECT_NE(dynamic_cast<const TriangleMesh*>(scene.objects[2].shape.get()), nullptr);
  EXPECT_EQ(scene.objects[2].X_WO.translation(), Vector3(0, 0, 9));
  EXPECT_EQ(scene.state[0], 0.25);
}

TEST_F(PlanningSceneFile, PlacesTheRobotWithWhatItHoldsAndMayTouch) {
  const PlanningScene scene = load(kScene);
  ASSERT_EQ(scene.held.size(), 1u);
  EXPECT_EQ(scene.held[0].link, "arm");
  EXPECT_EQ(scene.held[0].touch_links, std::vector<std::string>{"base"});
  EXPECT_NE(dynamic_cast<const Cone*>(scene.held[0].shape.get()), nullptr);
  const Robot robot = scene.place(robot_);
  ASSERT_TRUE(robot.chain->find_link("tool"));
  // The ball may pass the post, the tool, whose wide end reaches 0.05 to its sides, may not.
  const ChainResult result = turn_among(scene);
  ASSERT_EQ(result.toi.status, ToiStatus::Impact);
  EXPECT_EQ(robot.chain->links()[*result.link_a].name, "tool");
  PlanningScene free = scene;
  free.held.clear();
  EXPECT_EQ(turn_among(free).toi.status, ToiStatus::Separated);
  free.allowed.clear();
  EXPECT_EQ(turn_among(free).toi.status, ToiStatus::Impact);
}

TEST_F(PlanningSceneFile, ReadsJsonToo) {
  const char* text = R"({"world": {"collision_objects": [{"id": "a", "primitives":
    [{"type": 2, "dimensions": [3]}], "primitive_poses": [{"position": {"x": 1, "y": 2, "z": 3}}]}]}})";
  const PlanningScene scene = load(text, "s.json");
  EXPECT_EQ(scene.objects.at(0).X_WO.translation(), Vector3(1, 2, 3));
  EXPECT_TRUE(is_planning_scene(directory_.path() / "s.json"));
  EXPECT_FALSE(is_planning_scene(directory_.write("t.json", R"({"bodies": []})")));
  EXPECT_FALSE(is_planning_scene(directory_.path() / "none.json"));
}

TEST_F(PlanningSceneFile, TakesPlanesAsHalfSpaces) {
  const PlanningScene scene = load(R"(
world:
  collision_objects:
    - id: room
      pose: {position: [0, 0, 1]}
      primitives: [{type: sphere, dimensions: [0.5]}]
      primitive_poses: [{position: [9, 0, 0]}]
      planes: [{coef: [0, 0, 2, 1]}, {coef: {a: 0, b: -1, c: 0, d: 0}}]
      plane_poses:
        - position: [0, 0, 3]
          orientation: [1, 0, 0, 0]
        - position: [0, 0.95, 0]
allowed_collision_matrix:
  default_entry_names: [floor]
  default_entry_values: [true]
)");
  ASSERT_EQ(scene.objects.size(), 3u);
  for (const PlanningObject& each : scene.objects) EXPECT_EQ(each.name, "room");
  // 2 z + 1 <= 0, turned over about x: what lies above z = 4.5.
  const auto& ceiling = dynamic_cast<const HalfSpace&>(*scene.objects[1].shape);
  EXPECT_EQ(ceiling.offset(), -0.5);
  const auto height = [](const PlanningObject& each, const Vector3& p_W) {
    return dynamic_cast<const HalfSpace&>(*each.shape).height(each.X_WO.inverse() * p_W);
  };
  EXPECT_NEAR(height(scene.objects[1], Vector3(7, 8, 4)), 0.5, 1e-12);
  EXPECT_NEAR(height(scene.objects[1], Vector3(7, 8, 5)), -0.5, 1e-12);
  // The wall is y >= 0.95; the ball of radius 0.1 at the end of the arm stands at y = sin(angle).
  const ChainResult result = turn_among(scene);
  ASSERT_EQ(result.toi.status, ToiStatus::Impact);
  EXPECT_NEAR(result.toi.t_safe, std::asin(0.85) / 2, 1e-5);
}

TEST_F(PlanningSceneFile, ReadsAnOctree) {
  // The root's child 7 is occupied: a cube of 2^15 cells above zero along all axes.
  const PlanningScene scene = load(R"(
world:
  octomap:
    header: {frame_id: base}
    origin: {position: [-10, 0.95, -5], orientation: [0, 0, 0, 1]}
    octomap: {binary: true, id: OcTree, resolution: 0.001, data: [0, -128]}
)");
  ASSERT_EQ(scene.objects.size(), 1u);
  EXPECT_EQ(scene.objects[0].name, "<octomap>");
  EXPECT_EQ(scene.objects[0].X_WO.translation(), Vector3(-10, 0.95, -4));
  EXPECT_NEAR(scene.objects[0].shape->bounding_box().max().x(), 32.768, 1e-9);
  const ChainResult result = turn_among(scene);
  ASSERT_EQ(result.toi.status, ToiStatus::Impact);
  EXPECT_NEAR(result.toi.t_safe, std::asin(0.85) / 2, 1e-5);
  EXPECT_TRUE(load("world: {octomap: {octomap: {data: []}}}").objects.empty());
}

std::string object(const std::string& body) {
  return "world: {collision_objects: [{id: a, " + body + "}]}";
}

TEST_F(PlanningSceneFile, NamesWhatItCannotRead) {
  expect_refused("[1]", "an object");
  expect_refused("bodies: []", "expected a planning scene");
  expect_refused("{world: {}, robot_sate: {}}", "unknown key 'robot_sate'");
  expect_refused("world: {colision_objects: []}", "unknown key 'colision_objects'");
  expect_refused(object("primitives: [{type: sphere, dimensions: [1]}], poze: {}"), "key 'poze'");
  expect_refused(object("primitives: []"), "neither primitives nor meshes");
  expect_refused(object("planes: [{coef: [0, 0, 0, 1]}]"), "normal");
  expect_refused(object("planes: [{coef: [0, 0, 1]}]"), "expected at least 4 elements, found 3");
  expect_refused(object("planes: [{coef: [0, 0, 1, 0]}], plane_poses: [{}, {}]"), "2 for 1");
  expect_refused(
      "robot_state: {attached_collision_objects: [{link_name: arm, object: {id: o, planes: "
      "[{coef: [0, 0, 1, 0]}]}}]}",
      "a plane cannot be held");
  expect_refused(object("primitives: [{type: tube, dimensions: [1]}]"), "primitives[0].type");
  expect_refused(object("primitives: [{type: 5, dimensions: [1]}]"), "1 (box)");
  expect_refused(object("primitives: [{type: box, dimensions: [1, 2]}]"), "expected 3 dimensions");
  expect_refused(object("primitives: [{type: sphere, dimensions: [-1]}]"), "a number > 0");
  expect_refused(object("primitives: [{type: sphere, dimensions: [1]}], primitive_poses: [{}, {}]"),
                 "2 for 1");
  expect_refused(object("primitives: [{type: sphere, dimensions: [1]}], "
                        "pose: {orientation: [0, 0, 1, 1]}"),
                 "norm one");
  expect_refused(object("header: {frame_id: arm}, primitives: [{type: sphere, dimensions: [1]}]"),
                 "rests in the world");
  expect_refused(object("meshes: [{resource: a.stl}]"), "`vertices`");
  expect_refused(object("meshes: [{vertices: [[0, 0, 0]], triangles: [[0, 1, 2]]}]"),
                 "the number of a vertex");
  const auto octree = [](const std::string& rest) {
    return "world: {octomap: {octomap: {id: OcTree, binary: true, " + rest + "}}}";
  };
  expect_refused(octree("resolution: 0.5, data: [1]"), "truncated");
  expect_refused(octree("resolution: 0.5, data: [0, 300]"), "octomap.data[1]: expected a byte");
  expect_refused(octree("resolution: -1, data: [0, -128]"), "a number > 0");
  expect_refused("world: {octomap: {octomap: {data: [1]}}}", "'id'");
  expect_refused("robot_state: {joint_state: {name: [turn], position: []}}", "0 for 1");
  expect_refused("robot_state: {attached_collision_objects: [{link_name: leg, object: {id: x}}]}",
                 "name of a link");
  expect_refused("world: {}\nallowed_collision_matrix: {entry_names: [a], entry_values: []}",
                 "a row for every name");
}

}  // namespace
}  // namespace dyop
