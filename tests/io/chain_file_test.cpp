// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "dyop/io/file_error.h"
#include "dyop/io/robot_file.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

class ChainFile : public ::testing::Test {
 protected:
  KinematicChain load(const std::string& text) const {
    return load_chain(directory_.write("chain.json", text));
  }
  std::string message_of(const std::string& text) const {
    try {
      load(text);
    } catch (const FileError& error) {
      return error.what();
    }
    return "no error";
  }
  void expect_message(const std::string& text, const std::string& part) const {
    const std::string message = message_of(text);
    EXPECT_NE(message.find(part), std::string::npos) << message;
    EXPECT_NE(message.find("chain.json"), std::string::npos) << message;
  }

  testing::TemporaryDirectory directory_;
};

constexpr const char* kArm = R"({
  "base": {"position": [0, 0, 1]},
  "links": [
    {"name": "base"},
    {"name": "arm", "groups": [0, 31], "solid": true,
     "shapes": [{"shape": {"mesh": "block.obj"}}]},
    {"name": "hand", "shapes": [
      {"shape": {"sphere": {"radius": 0.1}}, "pose": {"position": [1, 0, 0]}},
      {"shape": {"box": {"half_extents": [0.1, 0.2, 0.3]}}}]}],
  "joints": [
    {"name": "lift", "type": "prismatic", "parent": "base", "child": "arm", "axis": [0, 0, 2],
     "limits": [0, 0.5]},
    {"name": "turn", "type": "revolute", "parent": "arm", "child": "hand",
     "origin": {"position": [1, 0, 0], "euler_degrees": [0, 0, 90]}, "axis": [0, 1, 0]}],
  "ignored_pairs": [["base", "hand"]]})";

TEST_F(ChainFile, ReadsLinksAndJoints) {
  directory_.write("block.obj",
                   "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
  const KinematicChain chain = load(kArm);
  ASSERT_EQ(chain.links().size(), 3u);
  EXPECT_EQ(chain.coordinate_count(), 2u);
  EXPECT_EQ(chain.links()[0].shape, nullptr);
  EXPECT_EQ(chain.links()[1].groups, 0x80000001u);
  EXPECT_TRUE(chain.links()[1].is_solid);
  EXPECT_EQ(chain.links()[1].shape->kind(), ShapeKind::TriangleMesh);
  EXPECT_EQ(chain.links()[2].shape->kind(), ShapeKind::Compound);
  EXPECT_EQ(chain.joints()[0].upper, 0.5);
  EXPECT_EQ(chain.joints()[1].lower, -kInfinity);
  JointVector q(2);
  q << 0.25, 1.5707963267948966;
  const std::vector<RigidPose> poses = chain.link_poses(q);
  EXPECT_LT((poses[2].translation() - Vector3(1, 0, 1.25)).norm(), 1e-15);
  // A quarter turn about y takes z to x, in the joint's frame, whose x is the world's y.
  EXPECT_LT((poses[2].rotation() * Vector3::UnitZ() - Vector3::UnitY()).norm(), 1e-15);
}

TEST_F(ChainFile, NamesTheKeyThatIsWrong) {
  expect_message(R"({"links": []})", "links");
  expect_message(R"({"links": [{"name": "a", "colour": 1}]})", "colour");
  expect_message(R"({"links": [{"name": "a", "groups": [32]}]})", "links[0].groups[0]");
  expect_message(R"({"links": [{"name": "a"}, {"name": "b"}], "joints": [
    {"name": "j", "type": "ball", "parent": "a", "child": "b"}]})",
                 "fixed, revolute, prismatic");
  expect_message(R"({"links": [{"name": "a"}, {"name": "b"}], "joints": [
    {"name": "j", "type": "fixed", "parent": "a", "child": "b", "axis": [0, 0, 1]}]})",
                 "joints[0].axis");
  expect_message(R"({"links": [{"name": "a"}, {"name": "b"}], "joints": [
    {"name": "j", "type": "revolute", "parent": "a", "child": "b", "limits": [1]}]})",
                 "[lower, upper]");
  expect_message(R"({"links": [{"name": "a"}, {"name": "b"}], "joints": [
    {"name": "j", "type": "revolute", "parent": "a", "child": "x"}]})",
                 "'x' is not a link");
  expect_message(R"({"links": [{"name": "a"}], "ignored_pairs": [["a"]]})", "two names");
}

}  // namespace
}  // namespace dyop
