// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "dyop/chain/certify_chain.h"
#include "dyop/chain/link_pairs.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/io/file_error.h"
#include "dyop/io/robot_file.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

constexpr const char* kBall = "<geom size='.1'/>";

class MjcfFile : public ::testing::Test {
 protected:
  Robot load(const std::string& body, const RobotFileOptions& options = {}) const {
    const std::string text = "<mujoco model='m'>\n" + body + "</mujoco>\n";
    return load_robot(directory_.write("model.xml", text), options);
  }
  Robot load_world(const std::string& world) const {
    return load("<worldbody>" + world + "</worldbody>");
  }
  // The message has this part, and names the file and a line.
  void expect_message(const std::string& body, const std::string& part,
                      const RobotFileOptions& options = {}) const {
    try {
      load(body, options);
      FAIL() << "no error: " << part;
    } catch (const FileError& error) {
      const std::string message = error.what();
      EXPECT_NE(message.find(part), std::string::npos) << message;
      EXPECT_NE(message.find("model.xml:"), std::string::npos) << message;
    }
  }
  void expect_world_message(const std::string& world, const std::string& part) const {
    expect_message("<worldbody>" + world + "</worldbody>", part);
  }

  testing::TemporaryDirectory directory_;
};

const Link& link_of(const Robot& robot, const std::string& name) {
  return robot.chain->links()[robot.chain->find_link(name).value()];
}

bool is_checked(const Robot& robot, const std::string& a, const std::string& b) {
  const std::pair<std::size_t, std::size_t> wanted =
      std::minmax(robot.chain->find_link(a).value(), robot.chain->find_link(b).value());
  const auto pairs = robot.chain->self_pairs();
  return std::any_of(pairs.begin(), pairs.end(), [&](const KinematicChain::LinkPair& pair) {
    return pair.first == wanted.first && pair.second == wanted.second;
  });
}

TEST_F(MjcfFile, ReadsBodiesJointsAndMasses) {
  const Robot robot = load(R"(<compiler angle="radian"/><worldbody>
    <body name="arm" pos="0 0 1"><inertial pos="0 0 0" mass="3"/>
      <joint name="turn" axis="0 1 0" range="-1 2"/><geom type="box" size=".1 .2 .3"/>
      <body pos="1 0 0"><geom size=".1" mass="2"/>
        <geom type="box" size=".5 .1 .1" density="25"/>
        <joint name="slide" type="slide" range="0 .5" limited="false"/></body></body>
    </worldbody>)");
  EXPECT_EQ(robot.name, "m");
  ASSERT_EQ(robot.chain->links().size(), 3u);
  EXPECT_EQ(robot.chain->links()[0].name, "world");
  EXPECT_EQ(robot.chain->links()[2].name, "body2");
  EXPECT_EQ(robot.masses, (std::vector<Scalar>{0, 3, 3}));
  ASSERT_EQ(robot.free_count(), 2u);
  EXPECT_EQ(robot.chain->joints()[0].upper, 2);
  EXPECT_EQ(robot.chain->joints()[1].upper, kInfinity);
  EXPECT_EQ(link_of(robot, "body2").shape->kind(), ShapeKind::Compound);
}

TEST_F(MjcfFile, ScalesMassesAsTheCompilerSays) {
  const auto masses = [&](const std::string& compiler) {
    return load("<compiler " + compiler + R"(/><worldbody>
      <body><inertial pos="0 0 0" mass="3"/><geom size=".1" mass="1"/>
        <body><geom size=".1" mass="2"/></body>
        <body><inertial pos="0 0 0" mass="0.5"/></body></body></worldbody>)")
        .masses;
  };
  using Masses = std::vector<Scalar>;
  EXPECT_EQ(masses(""), (Masses{0, 3, 2, 0.5}));
  EXPECT_EQ(masses(R"(settotalmass="11")"), (Masses{0, 6, 4, 1}));
  EXPECT_EQ(masses(R"(settotalmass="-1")"), (Masses{0, 3, 2, 0.5}));
  EXPECT_EQ(masses(R"(inertiafromgeom="true")"), (Masses{0, 1, 2, 0.5}));
  EXPECT_EQ(masses(R"(inertiafromgeom="false" boundmass="0.75")"), (Masses{0, 3, 0.75, 0.75}));
  EXPECT_THROW(masses(R"(inertiafromgeom="yes")"), FileError);
  EXPECT_THROW(masses(R"(settotalmass="heavy")"), FileError);
}

TEST_F(MjcfFile, LimitsAreInTheUnitOfTheCompiler) {
  const Robot robot = load_world(
      R"(<body><joint name="a" range="-90 180"/><geom size=".1"/>
         <body><joint name="b" type="slide" range="-90 180"/><geom size=".1"/></body></body>)");
  EXPECT_DOUBLE_EQ(robot.chain->joints()[0].lower, -std::numbers::pi / 2);
  EXPECT_EQ(robot.chain->joints()[1].lower, -90);
}

// The nearest class counts: the element's own, then that of the body, then the outermost one.
TEST_F(MjcfFile, AppliesDefaultsByClass) {
  const Robot robot = load(R"(<default><geom size=".1"/>
      <default class="wide"><geom size=".2"/><default class="wider"><geom size=".3"/></default>
      <default class="box"><geom type="box" size="1 1 1"/></default></default></default>
    <worldbody><geom/><body name="a" childclass="wide"><geom/><body name="b"><geom/>
      <body name="c"><geom class="wider"/></body></body><body name="d" childclass="box">
      <geom/></body></body></worldbody>)");
  const auto radius = [&](const char* link) {
    return dynamic_cast<const Sphere&>(*link_of(robot, link).shape).radius();
  };
  EXPECT_EQ(radius("world"), 0.1);
  EXPECT_EQ(radius("a"), 0.2);
  EXPECT_EQ(radius("b"), 0.2);
  EXPECT_EQ(radius("c"), 0.3);
  EXPECT_NE(dynamic_cast<const Box*>(link_of(robot, "d").shape.get()), nullptr);
}

TEST_F(MjcfFile, FollowsIncludesWhereTheyStand) {
  directory_.write("part.xml",
                   "<mujocoinclude><body name='in'><geom size='.1'/></body></mujocoinclude>");
  directory_.write("arm.xml",
                   "<mujoco><compiler angle='radian'/><worldbody><body name='arm'><joint "
                   "range='0 1'/><geom size='.1'/><include file='part.xml'/></body></worldbody>"
                   "</mujoco>");
  const Robot robot =
      load("<include file='arm.xml'/><worldbody><geom type='plane' size='1 1 1'/></worldbody>");
  EXPECT_EQ(robot.chain->joints()[robot.free_joints[0]].upper, 1);
  const KinematicChain& chain = *robot.chain;
  EXPECT_EQ(chain.common_ancestor(*chain.find_link("in"), *chain.find_link("arm")),
            *chain.find_link("arm"));
  directory_.write("loop.xml", "<mujoco><include file='loop.xml'/></mujoco>");
  EXPECT_THROW(load("<include file='loop.xml'/>"), FileError);
  EXPECT_THROW(load("<include file='none.xml'/>"), MissingFile);
}

TEST_F(MjcfFile, FramesMoveWhatTheyHold) {
  const Robot robot = load_world(
      R"(<frame pos="1 0 0" euler="0 0 90"><body name="a" pos="1 0 0">
         <frame pos="0 0 1"><geom size=".1"/><joint name="x" type="slide" axis="1 0 0"/></frame>
         <joint name="y" axis="0 0 1"/></body></frame>)");
  JointVector q(2);
  q << 2, 0;
  const RigidPose X_WA = robot.chain->link_poses(q)[*robot.chain->find_link("a")];
  EXPECT_LT((X_WA.translation() - Vector3(1, 3, 0)).norm(), 1e-15);
  const Shape& shape = *link_of(robot, "a").shape;
  EXPECT_EQ(shape.bounding_box().center(), Vector3(0, 0, 1));
}

TEST_F(MjcfFile, ReadsMeshesOfCollidingGeomsOnly) {
  create_directory(directory_.path() / "parts");
  directory_.write("parts/t.obj",
                   "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
  const Robot robot = load(R"(<compiler meshdir="parts"/><asset><mesh file="t.obj"/>
      <mesh name="big" file="t.obj" scale="2 -2 2" refpos="1 0 0"/><mesh file="not-there.stl"/>
      </asset><worldbody><body name="a"><geom type="mesh" mesh="t"/>
      <geom type="mesh" mesh="not-there" contype="0" conaffinity="0"/></body>
      <body name="b"><geom type="mesh" mesh="big"/></body></worldbody>)");
  const auto& small = dynamic_cast<const TriangleMesh&>(*link_of(robot, "a").shape);
  const auto& big = dynamic_cast<const TriangleMesh&>(*link_of(robot, "b").shape);
  EXPECT_TRUE(link_of(robot, "a").is_solid);
  EXPECT_EQ(big.bounding_box().min(), Vector3(-2, -2, 0));
  EXPECT_DOUBLE_EQ(big.compute_mass_properties(1).mass, 8 * small.compute_mass_properties(1).mass);
}

TEST_F(MjcfFile, CouplesJointsThatAnEqualityTies) {
  const Robot robot = load(R"(<compiler angle="radian"/><worldbody>
      <body><joint name="a" ref=".25"/><geom size=".1"/></body>
      <body><joint name="b" ref=".5"/><geom size=".1"/></body>
      <body><joint name="c"/><geom size=".1"/></body></worldbody>
    <equality><joint joint1="a" joint2="b" polycoef=".125 2 0 0 0"/>
      <joint joint1="c" joint2="b" polycoef="0 1 1 0 0"/>
      <joint joint1="c" joint2="a" active="false"/><connect body1="body1" anchor="0 0 0"/>
    </equality>)");
  EXPECT_EQ(robot.free_count(), 2u);
  JointVector q(2);
  q << 1.5, 0;
  EXPECT_EQ(robot.expand(q)[0], 0.25 + 0.125 + 2 * (1.5 - 0.5));
  EXPECT_EQ(robot.notes.size(), 2u);
}

TEST_F(MjcfFile, ChecksThePairsThatMujocoChecks) {
  const std::string chain =
      std::string("<body name='a'>") + kBall + "<joint name='ja'/><body name='b'>" + kBall +
      "<joint name='jb'/><body name='c'>" + kBall + "<joint name='jc'/></body></body></body>";
  const std::string floor = "<geom name='floor' type='plane' size='1 1 1' pos='0 0 -9'/>";
  const Robot robot = load("<worldbody>" + floor + chain + "</worldbody>");
  EXPECT_TRUE(is_checked(robot, "floor", "a"));  // neighbours, but one is the world
  EXPECT_TRUE(is_checked(robot, "a", "c"));
  EXPECT_FALSE(is_checked(robot, "a", "b"));
  const Robot excluding = load("<worldbody>" + floor + chain +
                               "</worldbody><contact><exclude body1='a' body2='c'/></contact>");
  EXPECT_FALSE(is_checked(excluding, "a", "c"));
  EXPECT_EQ(excluding.disabled_pairs[0].reason, "excluded");
  const Robot all =
      load("<option><flag filterparent='disable'/></option><worldbody>" + chain + "</worldbody>");
  EXPECT_TRUE(is_checked(all, "a", "b"));
}

TEST_F(MjcfFile, PlanesOfBodiesThatRestAreLinksOfTheirOwn) {
  const Robot robot = load_world(R"(<body name="table" pos="0 0 1" euler="90 0 0">
      <geom name="top" type="plane" size="1 1 1"/><geom size=".1"/></body>
      <body name="a" pos="0 -3 0"><freejoint/><geom size=".1"/></body>)");
  const RigidPose X_WP =
      robot.chain->link_poses(JointVector::Zero(6))[robot.chain->find_link("top").value()];
  EXPECT_LT((X_WP.rotation().col(2) - Vector3(0, -1, 0)).norm(), 1e-15);
  EXPECT_EQ(X_WP.translation(), Vector3(0, 0, 1));
  EXPECT_TRUE(is_checked(robot, "top", "a"));
  EXPECT_FALSE(is_checked(robot, "top", "table"));
}

TEST_F(MjcfFile, ChecksExplicitPairsOfGeomsThatNothingElseTouches) {
  const Robot robot = load(R"(<default><geom size=".1" contype="0" conaffinity="0"/></default>
    <worldbody><geom name="floor" type="plane" size="1 1 1"/>
      <body name="a" pos="0 0 1"><freejoint/><geom name="g"/>
        <body name="b"><joint/><geom name="h"/></body></body>
      <body name="c" pos="0 0 2"><joint/><geom name="i"/></body></worldbody>
    <contact><pair geom1="g" geom2="h"/><pair geom1="floor" geom2="g"/></contact>)");
  EXPECT_TRUE(is_checked(robot, "a", "b"));
  EXPECT_TRUE(is_checked(robot, "floor", "a"));
  EXPECT_EQ(robot.chain->self_pairs().size(), 2u);
  EXPECT_EQ(link_of(robot, "c").shape, nullptr);
}

// A floor without an end serves in proofs like any other link.
TEST_F(MjcfFile, ThePathOfAnArmAboveAFloorIsProven) {
  const Robot robot = load(R"(<compiler angle="radian"/><worldbody>
      <geom name="floor" type="plane" size="0 0 1"/>
      <body name="arm" pos="0 0 1"><joint axis="0 1 0" range="-3 3"/>
        <geom type="capsule" size=".1" fromto="0 0 0 .85 0 0"/></body></worldbody>)");
  const auto angle = [](Scalar q) -> JointVector { return JointVector::Constant(1, q); };
  const std::vector<Scalar> times{0, 1};
  const JointPath path = JointPath::linear(times, std::vector{angle(-3), angle(3)});
  EXPECT_EQ(certify(*robot.chain, path, ObstacleSet()).toi.status, ToiStatus::Separated);
  std::vector<LinkPairReport> pairs = decide_link_pairs(robot);
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0].verdict, PairVerdict::Never);
}

// Heights lie between zero and the third size; a text goes from the top, where y is largest, down.
TEST_F(MjcfFile, ReadsHeightFields) {
  const Robot robot = load(R"(<asset>
      <hfield name="hill" nrow="2" ncol="3" size="4 1 2 .5" elevation="7 3 3  3 3 5"/></asset>
    <worldbody><geom type="hfield" hfield="hill" pos="0 0 1"/>
      <body name="ball" pos="0 0 9"><freejoint/><geom size=".1" mass="1"/></body></worldbody>)");
  const Link& world = link_of(robot, "world");
  EXPECT_TRUE(world.is_solid);
  ASSERT_NE(world.shape, nullptr);
  const AlignedBox box = world.shape->bounding_box();
  EXPECT_TRUE(box.min().isApprox(Vector3(-4, -1, 0.5), 1e-15)) << box.min().transpose();
  EXPECT_TRUE(box.max().isApprox(Vector3(4, 1, 3), 1e-15)) << box.max().transpose();
  const auto& ground = dynamic_cast<const CompoundShape&>(*world.shape);
  const auto& mesh = dynamic_cast<const TriangleMesh&>(*ground.children()[0].shape);
  EXPECT_EQ(mesh.vertices()[0], Vector3(-4, -1, 0));
  EXPECT_EQ(mesh.vertices()[2], Vector3(4, -1, 1));
  EXPECT_EQ(mesh.vertices()[3], Vector3(-4, 1, 2));
  EXPECT_TRUE(is_checked(robot, "world", "ball"));
}

// However large it says it is.
TEST_F(MjcfFile, AHeightFieldWithoutHeightsIsFlat) {
  const Robot robot = load(R"(<asset>
      <hfield name="h" nrow="2000000000" ncol="1000000000" size="1 2 3 4"/></asset>
    <worldbody><geom type="hfield" hfield="h"/></worldbody>)");
  const AlignedBox box = link_of(robot, "world").shape->bounding_box();
  EXPECT_EQ(box.min(), Vector3(-1, -2, -4));
  EXPECT_EQ(box.max(), Vector3(1, 2, 0));
}

TEST_F(MjcfFile, NamesWhatIsWrongInHeightFields) {
  const auto expect = [this](const std::string& field, const std::string& part) {
    expect_message("<asset><hfield name='h' " + field +
                       "/></asset><worldbody><geom type='hfield' hfield='h'/></worldbody>",
                   part);
  };
  const std::string size = "size='1 1 1 1' ";
  expect("nrow='2' ncol='2'", "'size'");
  expect("size='1 1 0 1' nrow='2' ncol='2'", "four numbers > 0");
  expect(size, "'nrow'");
  expect(size + "nrow='1' ncol='2'", "nrow: expected a whole number >= 2");
  expect(size + "nrow='2' ncol='2.5'", "ncol: expected a whole number >= 2");
  expect(size + "nrow='2' ncol='2' elevation='1 2 3'", "expected 2 x 2 numbers, found 3");
  expect(size + "nrow='2' ncol='2' elevation='1 2 3 nan'", "elevation");
  expect(size + "file='ground.PNG'", "PNG");
  expect(size + "file='none.bin'", "none.bin");
  directory_.write("ground.bin", std::string("\2\0\0\0\2\0\0\0short", 13));
  expect(size + "file='ground.bin'", "found 13 bytes with the counts 2 and 2");
  directory_.write("ground.bin", std::string("\377\377\377\177\377\377\377\177", 8));
  expect(size + "file='ground.bin'", "expected a binary height field");
  const std::string nan("\0\0\300\177", 4);
  directory_.write("ground.bin", std::string("\2\0\0\0\2\0\0\0", 8) + nan + nan + nan + nan);
  expect(size + "file='ground.bin'", "finite");
}

TEST_F(MjcfFile, NamesWhatIsWrong) {
  const std::string body = std::string("<body name='a'>") + kBall;
  expect_message("", "expected a body");
  expect_message("<compiler coordinate='global'/>", "coordinate: expected local");
  expect_message("<compiler eulerseq='xyw'/>", "eulerseq");
  expect_message("<compiler angle='grad'/>", "angle: expected degree or radian");
  expect_message("<default><default><geom/></default></default>", "'class'");
  expect_world_message("<geom type='heights'/>", "type: expected plane");
  expect_world_message("<geom type='hfield' hfield='h'/>",
                       "hfield: expected the name of an hfield");
  expect_world_message("<geom size='.1 -.2' type='capsule'/>", "2 numbers > 0");
  expect_world_message("<geom type='capsule' size='.1' fromto='1 1 1 1 1 1'/>", "fromto");
  expect_world_message("<geom type='mesh' mesh='none'/>", "mesh: expected the name of a mesh");
  expect_world_message("<geom type='mesh'/>", "'mesh'");
  expect_world_message("<geom class='none'/>", "class");
  expect_world_message("<geom size='.1' quat='0 0 0 0'/>", "quat");
  expect_world_message("<geom size='.1' quat='1 0 0 0' euler='0 0 0'/>", "'quat' and 'euler'");
  expect_world_message(body + "<joint axis='0 0 0'/></body>", "axis");
  expect_world_message(body + "<joint range='1 0'/></body>", "range");
  expect_world_message(body + "<joint limited='true'/></body>", "'range'");
  expect_world_message(body + "<joint type='screw'/></body>", "type: expected hinge");
  expect_world_message(body + "<joint/><geom type='plane' size='1 1 1'/></body>",
                       "fixed to the world");
  expect_world_message(body + "</body><body name='a'/>", "second link");
  expect_world_message("<replicate count='3'><geom size='1'/></replicate>", "generate bodies");
  expect_message("<worldbody>" + body +
                     "</body></worldbody><contact><exclude body1='a' body2='b'/>"
                     "</contact>",
                 "body2: expected the name of a body");
  expect_message(
      "<asset><mesh name='m' vertex='0 0 0 1 0 0 0 1 0 0 0 1' face='0 1 4'/></asset>"
      "<worldbody><geom type='mesh' mesh='m'/></worldbody>",
      "number of a vertex");
  RobotFileOptions options;
  options.base = RobotBase::Floating;
  expect_message("<worldbody>" + body + "</body></worldbody>", "base", options);
}

TEST_F(MjcfFile, RefusesHostileFiles) {
  std::string many;
  for (int k = 0; k < 2'100; ++k) many += "<body/>";
  expect_world_message(many, "more than 2000 bodies");
  // Each file includes the next one twice.
  for (int k = 0; k < 19; ++k) {
    const std::string next = "<include file='" + std::to_string(k + 1) + ".xml'/>";
    directory_.write(std::to_string(k) + ".xml", "<mujoco>" + next + next + "</mujoco>");
  }
  directory_.write("19.xml", "<mujoco/>");
  EXPECT_THROW(load("<include file='0.xml'/>"), FileError);
}

}  // namespace
}  // namespace dyop
