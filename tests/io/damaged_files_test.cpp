// SPDX-License-Identifier: BSD-3-Clause

// Damaged files of every kind that io reads: an Error or what they say, never a crash or a hang.
// DYOP_DAMAGE_COUNT=1000 makes a soak of it. Recordings: record/recording_damage_test.cpp.

#include "support/damaged_files.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/io/file_error.h"
#include "dyop/io/mesh_file.h"
#include "dyop/io/motion_file.h"
#include "dyop/io/planning_scene_file.h"
#include "dyop/io/query_record.h"
#include "dyop/io/robot_file.h"
#include "io/collada_text.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/mesh_writers.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

class DamagedFiles : public ::testing::Test {
 protected:
  void expect_harmless(const std::string& name, const std::string& whole,
                       const std::function<void(const std::filesystem::path&)>& load) const {
    const std::filesystem::path file = directory_.write(name, whole);
    ASSERT_NO_THROW(load(file)) << name;
    const testing::DamageReport report = testing::read_damaged(
        whole, [&](const std::string& bytes) { load(directory_.write(name, bytes)); });
    EXPECT_EQ(report.disaster, "") << name;
    EXPECT_GT(report.refused, 0) << name;
  }
  void expect_harmless_mesh(const std::string& name, const std::string& whole) const {
    expect_harmless(name, whole, [](const std::filesystem::path& file) { load_mesh(file); });
  }

  testing::TemporaryDirectory directory_;
};

testing::Polygons ball() {
  const testing::MeshArrays arrays = testing::icosphere(1);
  testing::Polygons mesh{arrays.vertices, {}};
  for (const TriangleIndices& t : arrays.triangles)
    mesh.polygons.push_back({int(t[0]), int(t[1]), int(t[2])});
  return mesh;
}

#ifdef DYOP_HAS_ASSIMP
// A triangle, as one block of JSON and one of numbers.
std::string glb() {
  std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],)"
      R"("buffers":[{"byteLength":44}],"bufferViews":[{"buffer":0,"byteLength":36},)"
      R"({"buffer":0,"byteOffset":36,"byteLength":6}],"accessors":[{"bufferView":0,)"
      R"("componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},)"
      R"({"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}]})";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string numbers;
  const auto add = [](std::string& to, auto value) {
    to.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  for (const float x : {0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F}) add(numbers, x);
  for (const int k : {0, 1, 2, 0}) add(numbers, std::uint16_t(k));
  std::string file = "glTF";
  for (const std::size_t word : {std::size_t{2}, 28 + json.size() + numbers.size(), json.size()})
    add(file, std::uint32_t(word));
  file += "JSON" + json;
  add(file, std::uint32_t(numbers.size()));
  return file + std::string("BIN\0", 4) + numbers;
}
#endif

TEST_F(DamagedFiles, OfMeshesAreRefusedOrRead) {
  expect_harmless_mesh("m.obj", testing::obj_of(ball(), {.has_comments = true}));
  expect_harmless_mesh("m.off", testing::off_of(ball()));
  expect_harmless_mesh("m.ply", testing::ply_ascii_of(ball()));
  expect_harmless_mesh("m.stl", testing::stl_ascii_of(ball()));
  expect_harmless_mesh("b.stl", testing::stl_binary_of(ball()));
}

TEST_F(DamagedFiles, OfCompressedMeshesAreRefused) {
  const std::filesystem::path file = directory_.path() / "m.obj.gz";
  const gzFile out = gzopen(file.c_str(), "wb");
  const std::string text = testing::obj_of(ball());
  gzwrite(out, text.data(), unsigned(text.size()));
  gzclose(out);
  expect_harmless_mesh("m.obj.gz", testing::TemporaryDirectory::read(file));
}

#ifdef DYOP_HAS_ASSIMP
TEST_F(DamagedFiles, OfMeshesThatAssimpReadsAreRefusedOrRead) {
  expect_harmless_mesh("m.glb", glb());
  expect_harmless_mesh("m.dae", testing::kColladaTetrahedron);
}

// assimp goes on for ever, reads beyond its arrays, or takes gigabytes.
TEST_F(DamagedFiles, ThatAssimpCannotBearAreRefused) {
  for (const auto& [good, bad] : std::vector<std::pair<const char*, const char*>>{
           {"<p>0 2", "<p>0 x"},
           {"count=\"12\"", "count=\"-1\""},
           {"count=\"12\"", "count=\"9\""},
           {"stride=\"3\"", "stride=\"4\""},
           {"offset=\"0\"", "offset=\"4294967295\""}}) {
    std::string collada = testing::kColladaTetrahedron;
    collada.replace(collada.find(good), std::string_view(good).size(), bad);
    EXPECT_THROW(load_mesh(directory_.write("m.dae", collada)), FileError) << bad;
  }
  std::string binary = glb();
  binary[15] = char(0x70);
  EXPECT_THROW(load_mesh(directory_.write("m.glb", binary)), FileError);
}
#endif

constexpr const char* kUrdf = R"(<robot name="arm">
<link name="base"><collision><geometry><box size="1 1 0.2"/></geometry></collision></link>
<link name="upper"><collision><origin xyz="0 0 0.5" rpy="0 0.1 0"/>
<geometry><cylinder radius="0.1" length="1"/></geometry></collision></link>
<link name="hand"><collision><geometry><mesh filename="m.obj" scale="1 2 1"/></geometry>
</collision></link>
<joint name="turn" type="revolute"><parent link="base"/><child link="upper"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="lift" type="prismatic"><parent link="upper"/><child link="hand"/>
<origin xyz="0 0 1"/><axis xyz="0 0 1"/><limit lower="0" upper="0.5" effort="1" velocity="1"/>
<mimic joint="turn" multiplier="0.5" offset="0.1"/></joint></robot>)";

constexpr const char* kMjcf = R"(<mujoco model="arm"><compiler angle="radian" eulerseq="zyx"/>
<default><geom contype="1"/><default class="thin"><geom type="capsule" size=".1 .5"/></default>
</default><asset><mesh name="m" file="m.obj" scale="1 2 1" refpos="0 0 1"/></asset>
<worldbody><geom type="plane" size="1 1 1" pos="0 0 -3"/><body name="a" childclass="thin"
 pos="0 0 1"><joint name="turn" axis="0 1 0" range="-1 1" ref=".1" pos="0 .1 0"/><geom/>
<body name="b" euler="0 .1 0"><joint name="lift" type="slide"/><geom type="mesh" mesh="m"/>
</body></body></worldbody><contact><exclude body1="world" body2="b"/></contact>
<equality><joint joint1="lift" joint2="turn" polycoef=".1 .5 0 0 0"/></equality></mujoco>)";

constexpr const char* kSrdf = R"(<robot name="arm">
<group name="all"><chain base_link="base" tip_link="hand"/></group>
<disable_collisions link1="base" link2="upper" reason="Adjacent"/>
<disable_collisions link1="base" link2="hand" reason="Never"/></robot>)";

constexpr const char* kChain = R"({"base": {"position": [0, 0, 1]},
"links": [{"name": "base"}, {"name": "arm", "groups": [0, 31], "solid": true,
  "shapes": [{"shape": {"mesh": "m.obj"}}]},
 {"name": "hand", "shapes": [{"shape": {"sphere": {"radius": 0.1}}, "pose": {"position": [1, 0, 0]}},
  {"shape": {"box": {"half_extents": [0.1, 0.2, 0.3]}}}]}],
"joints": [{"name": "lift", "type": "prismatic", "parent": "base", "child": "arm",
  "axis": [0, 0, 2], "limits": [0, 0.5]},
 {"name": "turn", "type": "revolute", "parent": "arm", "child": "hand",
  "origin": {"position": [1, 0, 0], "euler_degrees": [0, 0, 90]}, "axis": [0, 1, 0]}],
"ignored_pairs": [["base", "hand"]]})";

TEST_F(DamagedFiles, OfRobotsAreRefusedOrRead) {
  directory_.write("m.obj", testing::obj_of(ball()));
  expect_harmless("r.urdf", kUrdf, [](const std::filesystem::path& file) { load_robot(file); });
  expect_harmless("m.xml", kMjcf, [](const std::filesystem::path& file) { load_robot(file); });
  const std::filesystem::path urdf = directory_.write("whole.urdf", kUrdf);
  expect_harmless("r.srdf", kSrdf, [&](const std::filesystem::path& file) {
    RobotFileOptions options;
    options.srdf = file;
    load_robot(urdf, options);
  });
  expect_harmless("c.json", kChain, [](const std::filesystem::path& file) { load_chain(file); });
}

constexpr const char* kCell = R"(
name: cell
robot_state:
  joint_state:
    name: [turn, some_wheel]
    position: [0.25, 9]
  attached_collision_objects:
    - link_name: hand
      object:
        header: {frame_id: hand}
        id: tool
        primitives:
          - {type: 4, dimensions: [0.2, 0.05]}
        primitive_poses:
          - position: {x: 1.07, y: 0, z: 0}
            orientation: {x: 0, y: 0, z: 0, w: 1}
      touch_links: [base]
world:
  collision_objects:
    - id: post
      header: {frame_id: base}
      primitives:
        - {type: 1, dimensions: [0.1, 0.1, 2]}
      primitive_poses:
        - position: {x: 2, y: 0, z: 1}
          orientation: {x: 0, y: 0, z: 0, w: 1}
)";

constexpr const char* kTrajectory = R"({"joint_trajectory": {"joint_names": ["turn"], "points": [
{"positions": [0], "velocities": [0], "time_from_start": {"secs": 0, "nsecs": 0}},
{"positions": [0.5], "velocities": [0.1], "time_from_start": {"secs": 1, "nsecs": 500000000}}]}})";

TEST_F(DamagedFiles, OfPlansAreRefusedOrRead) {
  directory_.write("m.obj", testing::obj_of(ball()));
  const Robot robot = load_robot(directory_.write("whole.urdf", kUrdf));
  expect_harmless("cell.yaml", kCell,
                  [&](const std::filesystem::path& file) { load_planning_scene(file, robot); });
  const auto load_path = [&](const std::filesystem::path& file) {
    load_joint_path(file, robot, PathInterpolation::Linear);
  };
  expect_harmless("path.csv", "t, turn\n0, 0\n1, 0.5 # half\n3, 0.25\n", load_path);
  expect_harmless("path.json", kTrajectory, load_path);
}

TEST_F(DamagedFiles, OfMotionsAreRefusedOrRead) {
  const std::string motion = R"({"kind": "sampled", "samples": [
{"time": 0, "pose": {"position": [0, 0, 0]}},
{"time": 1, "pose": {"position": [1, 0, 0], "euler_degrees": [0, 0, 90]}},
{"time": 2.5, "pose": {"position": [1, 2, 0], "quaternion": [1, 0, 0, 0]}}]})";
  expect_harmless("motion.json", motion,
                  [](const std::filesystem::path& file) { load_motion(file); });
}

}  // namespace
}  // namespace dyop
