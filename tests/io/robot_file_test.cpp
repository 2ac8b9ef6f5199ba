// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/robot_file.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <numbers>

#include "dyop/distance/distance.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/io/file_error.h"
#include "io/collada_text.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

// A closed tetrahedron with corners at the origin and on the axes, in each format.
constexpr const char* kObj =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";

std::string link(const std::string& name, const std::string& geometry) {
  return "<link name=\"" + name + "\"><collision><geometry>" + geometry +
         "</geometry></collision></link>\n";
}

std::string joint(const std::string& type, const std::string& parent, const std::string& child,
                  const std::string& inside = "") {
  return "<joint name=\"to_" + child + "\" type=\"" + type + "\"><parent link=\"" + parent +
         "\"/><child link=\"" + child + "\"/>" + inside + "</joint>\n";
}

class RobotFile : public ::testing::Test {
 protected:
  Robot load(const std::string& body, RobotFileOptions options = {}) const {
    return load_robot(directory_.write("robot.urdf", "<robot name=\"r\">\n" + body + "</robot>\n"),
                      options);
  }
  std::string message_of(const std::string& body, const RobotFileOptions& options = {}) const {
    try {
      load(body, options);
    } catch (const FileError& error) {
      return error.what();
    }
    return "no error";
  }
  // The message has this part, and names the file and a line.
  void expect_message(const std::string& body, const std::string& part, int line = 0) const {
    const std::string message = message_of(body);
    EXPECT_NE(message.find(part), std::string::npos) << message;
    EXPECT_NE(message.find("robot.urdf:"), std::string::npos) << message;
    if (line == 0) return;
    EXPECT_NE(message.find("robot.urdf:" + std::to_string(line) + ":"), std::string::npos)
        << message;
  }

  testing::TemporaryDirectory directory_;
};

constexpr const char* kLimit = "<axis xyz=\"0 0 2\"/><limit lower=\"-1\" upper=\"2\"/>";

TEST_F(RobotFile, ReadsLinksJointsAndPlaces) {
  const Robot robot =
      load(R"(<link name="base"/>)" + link("a", R"(<sphere radius="0.5"/>)") +
           R"(<link name="b"><inertial><mass value="3"/></inertial>
         <collision><origin xyz="1 0 0"/><geometry><box size="1 2 3"/></geometry></collision>
         <collision><geometry><sphere radius="0.1"/></geometry></collision></link>)" +
           joint("revolute", "base", "a",
                 R"(<origin xyz="0 0 1" rpy="0 0 1.5707963267948966"/>)" + std::string(kLimit)) +
           joint("prismatic", "a", "b", kLimit));
  EXPECT_EQ(robot.name, "r");
  EXPECT_EQ(robot.free_count(), 2u);
  EXPECT_EQ(robot.masses, (std::vector<Scalar>{0, 0, 3}));
  ASSERT_EQ(robot.chain->links().size(), 3u);
  EXPECT_EQ(robot.chain->links()[0].shape, nullptr);
  EXPECT_EQ(robot.chain->links()[2].shape->kind(), ShapeKind::Compound);
  EXPECT_EQ(robot.chain->joints()[0].lower, -1);
  JointVector q(2);
  q << 0, 0.5;
  const std::vector<RigidPose> poses = robot.chain->link_poses(robot.expand(q));
  EXPECT_LT((poses[2] * Vector3::UnitX() - Vector3(0, 1, 1.5)).norm(), 1e-15);
}

TEST_F(RobotFile, RollPitchYawTurnAboutFixedAxesInThatOrder) {
  const Robot robot = load("<link name=\"a\"/><link name=\"b\"/>" +
                           joint("fixed", "a", "b", R"(<origin rpy="0.3 -0.7 1.1"/>)"));
  const Matrix3 expected = rotation_from_vector(Vector3(0, 0, 1.1)) *
                           rotation_from_vector(Vector3(0, -0.7, 0)) *
                           rotation_from_vector(Vector3(0.3, 0, 0));
  EXPECT_LT((robot.chain->joints()[0].X_PJ.rotation() - expected).norm(), 1e-15);
}

TEST_F(RobotFile, AnOriginMayBeAQuaternion) {
  const std::string two = "<link name=\"a\"/><link name=\"b\"/>\n";
  const Robot robot =
      load(two + joint("fixed", "a", "b", R"(<origin xyz="1 2 3" quat_xyzw="0 0.6 0 0.8"/>)"));
  const RigidPose& X_PJ = robot.chain->joints()[0].X_PJ;
  const Vector3 turn(0, 2 * std::asin(Scalar(0.6)), 0);
  EXPECT_LT((X_PJ.rotation() - rotation_from_vector(turn)).norm(), 1e-15);
  EXPECT_EQ(X_PJ.translation(), Vector3(1, 2, 3));
  expect_message(two + joint("fixed", "a", "b", R"(<origin quat_xyzw="0 0 0 2"/>)"),
                 "quat_xyzw: expected a unit quaternion x y z w, found '0 0 0 2'", 3);
  expect_message(two + joint("fixed", "a", "b", R"(<origin quat_xyzw="0 0 1"/>)"), "'0 0 1'");
  expect_message(two + joint("fixed", "a", "b", R"(<origin rpy="0 0 0" quat_xyzw="0 0 0 1"/>)"),
                 "expected one of the attributes 'rpy' and 'quat_xyzw'", 3);
}

TEST_F(RobotFile, SplitsFloatingAndPlanarJoints) {
  const Robot robot =
      load("<link name=\"a\"/><link name=\"b\"/><link name=\"c\"/>" + joint("floating", "a", "b") +
           joint("planar", "b", "c", R"(<axis xyz="0 1 0"/>)"));
  ASSERT_EQ(robot.free_count(), 9u);
  JointVector q(9);
  q << 1, 2, 3, 0.3, 0.2, 0.1, 0, 0, std::numbers::pi;
  const std::vector<RigidPose> poses = robot.chain->link_poses(robot.expand(q));
  const RigidPose& X_Wb = poses[*robot.chain->find_link("b")];
  EXPECT_LT((X_Wb.translation() - Vector3(1, 2, 3)).norm(), 1e-15);
  const Matrix3 turn = rotation_from_vector(Vector3(0, 0, 0.3)) *
                       rotation_from_vector(Vector3(0, 0.2, 0)) *
                       rotation_from_vector(Vector3(0.1, 0, 0));
  EXPECT_LT((X_Wb.rotation() - turn).norm(), 1e-15);
  // Half a turn about y.
  const RigidPose X_bc = X_Wb.inverse() * poses[*robot.chain->find_link("c")];
  EXPECT_LT((X_bc * Vector3(1, 2, 3) - Vector3(-1, 2, -3)).norm(), 1e-14);
}

TEST_F(RobotFile, APlanarJointMovesWithinItsPlane) {
  const Robot robot = load("<link name=\"a\"/><link name=\"b\"/>" +
                           joint("planar", "a", "b", R"(<axis xyz="1 1 0"/>)"));
  JointVector q(3);
  q << 3, 4, 0;
  const Vector3 p = robot.chain->link_poses(q)[1].translation();
  EXPECT_NEAR(p.norm(), 5, 1e-14);
  EXPECT_NEAR(p.x() + p.y(), 0, 1e-14);
}

TEST_F(RobotFile, HoldsTheBaseAsAsked) {
  const std::string body = link("a", R"(<sphere radius="1"/>)");
  EXPECT_EQ(load(body, {.base = RobotBase::Floating}).free_count(), 6u);
  EXPECT_EQ(load(body, {.base = RobotBase::Planar}).free_count(), 3u);
}

TEST_F(RobotFile, CouplesMimickingJoints) {
  const Robot robot =
      load("<link name=\"a\"/><link name=\"b\"/><link name=\"c\"/><link name=\"d\"/>" +
           joint("revolute", "a", "b",
                 std::string(kLimit) + R"(<mimic joint="to_c" multiplier="-2" offset="1"/>)") +
           joint("continuous", "a", "c") +
           joint("revolute", "a", "d", std::string(kLimit) + R"(<mimic joint="to_b"/>)"));
  ASSERT_EQ(robot.free_count(), 1u);
  const JointVector q = robot.expand(JointVector::Constant(1, 0.25));
  EXPECT_EQ(q[0], 0.5);
  EXPECT_EQ(q[1], 0.25);
  EXPECT_EQ(q[2], 0.5);
  const std::vector<Scalar> times{0, 1};
  const std::vector<JointVector> ends{JointVector::Constant(1, 0), JointVector::Constant(1, 0.5)};
  EXPECT_EQ(robot.expand(JointPath::linear(times, ends)).position(0.5), q);
  EXPECT_THROW(robot.expand(JointPath::linear(times, std::vector<JointVector>(2, q))),
               InvalidArgument);
}

TEST_F(RobotFile, TellsWhatTheLimitsOfMimickingJointsDo) {
  const auto robot_of = [&](const std::string& limit) {
    return load("<link name=\"a\"/><link name=\"b\"/><link name=\"c\"/>" +
                joint("prismatic", "a", "b", R"(<limit lower="0" upper="1"/>)") +
                joint("prismatic", "a", "c", limit + R"(<mimic joint="to_b"/>)"));
  };
  const Robot wide = robot_of(R"(<limit lower="-1" upper="2"/>)");
  EXPECT_EQ(wide.notes, std::vector<std::string>());
  EXPECT_EQ(wide.upper()[0], 1);
  const Robot narrow = robot_of(R"(<limit lower="-1" upper="0.5"/>)");
  EXPECT_EQ(narrow.upper()[0], 0.5);
  ASSERT_EQ(narrow.notes.size(), 1u);
  EXPECT_EQ(narrow.notes[0],
            "the limits of 'to_c', which mimics it, hold joint 'to_b' to 0 to 0.5");
  for (const char* limit : {"<limit/>", R"(<limit lower="-1" upper="-0.5"/>)"}) {
    const Robot none = robot_of(limit);
    EXPECT_EQ(none.upper()[0], 1);
    ASSERT_EQ(none.notes.size(), 1u);
    EXPECT_EQ(none.notes[0].substr(0, 36), "the limits of 'to_c' are ignored: th");
  }
}

TEST_F(RobotFile, FindsMeshes) {
  std::filesystem::create_directories(directory_.path() / "arm" / "meshes");
  std::filesystem::create_directories(directory_.path() / "other" / "deep" / "col");
  directory_.write("arm/meshes/m.obj", kObj);
  directory_.write("other/deep/col/n.obj", kObj);
  const auto reach = [](const Robot& robot) {
    return robot.chain->links()[0].shape->bounding_box().max();
  };
  // The package is the folder "arm"; with and without the prefix, by a search path, and by name.
  EXPECT_EQ(reach(load(link("a", R"(<mesh filename="package://arm/meshes/m.obj"/>)"))),
            Vector3::Ones());
  EXPECT_EQ(reach(load(link("a", R"(<mesh filename="arm/meshes/m.obj" scale="1 -2 3"/>)"))),
            Vector3(1, 0, 3));
  EXPECT_EQ(reach(load(link("a", R"(<mesh filename="package://else/col/n.obj"/>)"),
                       {.package_paths = {directory_.path() / "other" / "deep"}})),
            Vector3::Ones());
  // Escapes of a URI, unless a file has that very name.
  directory_.write("arm/meshes/a b.obj", kObj);
  const std::string folder = (directory_.path() / "arm" / "meshes").string();
  for (const std::string& name :
       {"file://" + folder + "/a%20b.obj", std::string("package://arm/meshes/a%20b.obj")}) {
    EXPECT_EQ(load(link("a", "<mesh filename=\"" + name + "\"/>")).notes.size(), 0u);
  }
  directory_.write("arm/meshes/a%20b.obj", "v 0 0 0\nv 7 0 0\nv 0 7 0\nf 1 2 3\n");
  EXPECT_EQ(reach(load(link("a", R"(<mesh filename="package://arm/meshes/a%20b.obj"/>)"))),
            Vector3(7, 7, 0));
  const Robot moved = load(link("a", R"(<mesh filename="package://gone/col/n.obj"/>)"));
  ASSERT_EQ(moved.notes.size(), 1u);
  EXPECT_NE(moved.notes[0].find("deep/col/n.obj"), std::string::npos);
  expect_message(link("a", R"(<mesh filename="package://arm/meshes/x.obj"/>)"), "x.obj", 2);
  expect_message(link("a", R"(<mesh filename="http://arm/x.obj"/>)"), "package://");
}

TEST_F(RobotFile, AMirroredMeshStillFacesOutward) {
  directory_.write("m.obj", kObj);
  const Robot robot = load(link("a", R"(<mesh filename="m.obj" scale="0.1 -0.1 0.1"/>)"));
  EXPECT_TRUE(robot.chain->links()[0].is_solid);
  EXPECT_NEAR(robot.chain->links()[0].shape->compute_mass_properties(6000).mass, 1, 1e-12);
}

TEST_F(RobotFile, ColladaKeepsItsAxesAndConvertsItsUnit) {
  directory_.write("m.dae", testing::kColladaTetrahedron);
  Robot robot;
  try {
    robot = load(link("a", R"(<mesh filename="m.dae"/>)"));
  } catch (const FileError& error) {
    if (std::string(error.what()).find("needs assimp") == std::string::npos) throw;
    GTEST_SKIP() << error.what();
  }
  const Vector3 reach = robot.chain->links()[0].shape->bounding_box().max();
  EXPECT_LT((reach - Vector3(1, 2, 3)).norm(), 1e-6);
}

TEST_F(RobotFile, CylindersAreCylinders) {
  const Robot robot = load(link("a", R"(<cylinder radius="0.3" length="0.7"/>)"));
  const auto& shape = dynamic_cast<const Cylinder&>(*robot.chain->links()[0].shape);
  EXPECT_EQ(shape.radius(), 0.3);
  EXPECT_EQ(shape.half_length(), 0.35);
}

TEST_F(RobotFile, ReadsSrdf) {
  const std::string body = link("a", R"(<sphere radius="1"/>)") +
                           link("b", R"(<sphere radius="1"/>)") +
                           link("c", R"(<sphere radius="1"/>)") + joint("continuous", "a", "b") +
                           joint("continuous", "b", "c");
  RobotFileOptions options;
  options.srdf = directory_.write("r.srdf", R"(<robot name="r">
    <group name="arm"><chain base_link="a" tip_link="c"/></group>
    <disable_collisions link1="c" link2="a" reason="Never"/></robot>)");
  const Robot robot = load(body, options);
  ASSERT_EQ(robot.disabled_pairs.size(), 1u);
  EXPECT_EQ(robot.disabled_pairs[0].reason, "Never");
  ASSERT_EQ(robot.groups.size(), 1u);
  EXPECT_EQ(robot.groups[0].joints, (std::vector<std::string>{"to_b", "to_c"}));
  // A claim is checked all the same, unless it is trusted.
  EXPECT_EQ(robot.chain->self_pairs().size(), 1u);
  options.trusts_never = true;
  EXPECT_EQ(load(body, options).chain->self_pairs().size(), 0u);
  options.srdf = directory_.write(
      "r.srdf", "<robot>\n<disable_collisions link1=\"a\" link2=\"x\" reason=\"Never\"/></robot>");
  EXPECT_NE(message_of(body, options).find("r.srdf:2: <disable_collisions>: link2"),
            std::string::npos);
}

TEST_F(RobotFile, RefusesTheSrdfOfAnotherRobot) {
  const auto read = [&](const std::string& inside) {
    const auto srdf = directory_.write("r.srdf", "<robot name=\"r\">" + inside + "</robot>");
    return message_of("<link name=\"a\"/>", {.srdf = srdf});
  };
  EXPECT_EQ(read(""), "no error");
  EXPECT_EQ(read(R"(<group name="g"><link name="a"/><link name="gone"/></group>)"), "no error");
  EXPECT_EQ(read(R"(<group name="all"><group name="g"/></group>)"), "no error");
  EXPECT_NE(read(R"(<group name="g"><link name="b"/></group>)").find("names no link and no joint"),
            std::string::npos);
  EXPECT_NE(read(R"(<link name="a"/>)").find("not an SRDF file"), std::string::npos);
}

TEST_F(RobotFile, WritesSrdfThatItReads) {
  const std::string body =
      link("a", R"(<sphere radius="1"/>)") + link("b &amp; &lt;", R"(<sphere radius="1"/>)") +
      link("c", R"(<sphere radius="0.1"/>)") + joint("continuous", "a", "b &amp; &lt;") +
      joint("fixed", "b &amp; &lt;", "c", R"(<origin xyz="9 0 0"/>)");
  const Robot robot = load(body);
  RobotFileOptions options;
  options.srdf = directory_.write("out.srdf", srdf_text(robot, decide_link_pairs(robot)));
  const Robot again = load(body, options);
  ASSERT_EQ(again.disabled_pairs.size(), 3u);
  std::map<std::string, std::string> reasons;
  for (const DisabledPair& pair : again.disabled_pairs) {
    reasons[pair.first + "," + pair.second] = pair.reason;
  }
  EXPECT_EQ(reasons["a,b & <"], "Adjacent");
  EXPECT_EQ(reasons["a,c"], "Never");
}

TEST_F(RobotFile, NamesWhatIsWrong) {
  const std::string ball = R"(<sphere radius="1"/>)";
  const std::string two = link("a", ball) + link("b", ball);
  expect_message("<link/>", "<link>: expected the attribute 'name'", 2);
  expect_message(link("a", ball) + link("a", ball), "<link> 'a': a second link", 3);
  expect_message(link("a", "<cone/>"), "expected one of <mesh>");
  expect_message(link("a", R"(<box size="1 1 1"/><sphere radius="3"/>)"), "expected one shape");
  expect_message(link("a", ball + ball), "expected one shape", 2);
  expect_message(link("a", R"(<sphere radius="nan"/>)"),
                 "radius: expected a finite number, found 'nan'");
  expect_message(link("a", R"(<sphere radius="1e999"/>)"), "found '1e999'");
  expect_message(link("a", R"(<sphere radius="-1"/>)"), "radius: expected a number > 0");
  expect_message(link("a", R"(<sphere/>)"), "expected the attribute 'radius'");
  expect_message(link("a", R"(<box size="1 2"/>)"), "size: expected three finite numbers");
  expect_message(link("a", R"(<box size="1 0 1"/>)"), "three numbers > 0");
  expect_message(link("a", R"(<mesh filename="m.obj" scale="0 1 1"/>)"), "m.obj");
  expect_message(two + joint("ball", "a", "b"), "type: expected revolute, continuous", 4);
  expect_message(two + joint("revolute", "a", "b"), "expected an element <limit>");
  expect_message(two + joint("revolute", "a", "b", R"(<limit lower="2" upper="1"/>)"), "2 > 1");
  expect_message(two + joint("continuous", "a", "b", R"(<axis xyz="0 0 0"/>)"), "other than 0");
  expect_message(two + joint("continuous", "a", "b", R"(<mimic joint="x"/>)"), "found 'x'");
  expect_message(two + joint("continuous", "a", "b", R"(<mimic joint="to_b"/>)"), "loop");
  expect_message(two + joint("fixed", "a", "x"), "link: expected the name of a link, found 'x'");
  expect_message(two + joint("fixed", "a", "b") + joint("fixed", "a", "b"), "second joint");
  expect_message(two, "found 2, such as 'a' and 'b'");
  expect_message(two + joint("fixed", "a", "b") + joint("fixed", "b", "a"), "loop");
  expect_message(link("c", ball) + two + joint("fixed", "a", "b") + joint("fixed", "b", "a"),
                 "loop");
  expect_message("<link name=\"a\">", "not well-formed XML");
  expect_message("", "expected an element <link>");
}

// Links and joints that macros stand for would be missing without a word.
TEST_F(RobotFile, RefusesWhatXacroHasYetToExpand) {
  const std::string command = "run `xacro robot.urdf > expanded.urdf`";
  const std::string base = "<link name=\"base\"/>\n";
  expect_message(base + "<xacro:arm name=\"left\"/>\n<xacro:arm name=\"right\"/>",
                 "<xacro:arm> 'left': this element has yet to be expanded by xacro: " + command, 3);
  expect_message(base + "<link name=\"a\"><xacro:if value=\"1\"/></link>", "<xacro:if>", 3);
  expect_message("<link name=\"${prefix}a\"/>", "the attribute 'name'", 2);
  expect_message("<link name=\"a\">\n<inertial><mass value=\"$(arg m)\"/></inertial></link>",
                 "<mass>: the attribute 'value'", 3);
  expect_message("<link name=\"a\" xacro:x=\"1\"/>", "the attribute 'xacro:x'", 2);
  // The declaration stays in expanded files, as may a "${" that is a plugin's.
  const auto file = directory_.write(
      "arm.urdf.xacro", R"(<robot xmlns:x="http://ros.org/wiki/xacro" name="r"><link name="a"/>
<gazebo><plugin name="${env}"/></gazebo></robot>)");
  EXPECT_EQ(load_robot(file).chain->links().size(), 1);
  directory_.write(
      "arm.urdf.xacro",
      R"(<robot xmlns:x="http://ros.org/wiki/xacro"><x:arm/><link name="a"/></robot>)");
  try {
    load_robot(file);
    ADD_FAILURE() << "no error";
  } catch (const FileError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("<x:arm>"), message.npos) << message;
    EXPECT_NE(message.find("`xacro arm.urdf.xacro > arm.urdf`"), message.npos) << message;
  }
}

TEST_F(RobotFile, RefusesHostileFiles) {
  std::string deep;
  for (int k = 0; k < 100'000; ++k) deep += "<a>";
  expect_message(deep, "not well-formed XML");
  expect_message("<!DOCTYPE r [<!ENTITY e \"e\">]>" + link("&e;&e;", "<x/>"), "");
  std::string many;
  for (int k = 0; k < 10'001; ++k) many += "<link name=\"" + std::to_string(k) + "\"/>";
  expect_message(many, "more than 10000 links");
  for (const char* bytes :
       {"\xff", "\xc3", "\xc0\x80", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\x80"}) {
    expect_message("<link name=\"a" + std::string(bytes) + "\"/>", "UTF-8");
  }
  EXPECT_EQ(load("<link name=\"\xc3\xa9\xe2\x82\xac\xf0\x9f\xa4\x96\"/>").chain->links().size(),
            1u);
  const auto empty = directory_.write("empty.urdf", "");
  EXPECT_THROW(load_robot(empty), FileError);
  const auto other = directory_.write("other.urdf", "<sdf/>");
  EXPECT_THROW(load_robot(other), FileError);
  EXPECT_THROW(load_robot(directory_.path()), FileError);
  EXPECT_THROW(load_robot(directory_.path() / "none.urdf"), MissingFile);
}

// The robot of the outside data: all its claims, and none of its meshes twice.
TEST(RobotData, DecidesTheClaimsOfAPublicRobot) {
  const char* data = std::getenv("DYOP_EXTERNAL_DATA");
  if (data == nullptr) GTEST_SKIP() << "DYOP_EXTERNAL_DATA is not set";
  const std::filesystem::path folder = std::filesystem::path(data) / "robots" / "ur5";
  if (!exists(folder)) GTEST_SKIP() << folder << " is missing";
  RobotFileOptions options;
  options.srdf = folder / "ur5.srdf";
  const Robot robot = load_robot(folder / "ur5.urdf", options);
  EXPECT_EQ(robot.free_count(), 6u);
  std::map<std::pair<std::string, std::string>, PairVerdict> verdicts;
  for (const LinkPairReport& pair : decide_link_pairs(robot)) {
    EXPECT_NE(pair.verdict, PairVerdict::Undecided);
    const std::string& first = robot.chain->links()[pair.first].name;
    const std::string& second = robot.chain->links()[pair.second].name;
    verdicts[std::minmax(first, second)] = pair.verdict;
  }
  EXPECT_EQ(verdicts.size(), 153u);
  int claims = 0;
  for (const DisabledPair& pair : robot.disabled_pairs) {
    if (pair.reason != "Never") continue;
    ++claims;
    EXPECT_EQ(verdicts.at(std::minmax(pair.first, pair.second)), PairVerdict::Never)
        << pair.first << ' ' << pair.second;
  }
  EXPECT_EQ(claims, 62);
}

}  // namespace
}  // namespace dyop
