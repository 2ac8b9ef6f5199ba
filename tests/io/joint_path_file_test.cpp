// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "dyop/geometry/primitives.h"
#include "dyop/io/file_error.h"
#include "dyop/io/robot_file.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

// `turn` and `lift`, which cannot go below 2.
Robot make_arm() {
  const std::vector<Link> links{{"base"}, {"arm"}, {"hand"}};
  Joint turn;
  turn.name = "turn";
  turn.parent = "base";
  turn.child = "arm";
  Joint lift;
  lift.name = "lift";
  lift.type = JointType::Prismatic;
  lift.parent = "arm";
  lift.child = "hand";
  lift.lower = 2;
  lift.upper = 3;
  return make_robot("arm", KinematicChain(links, {turn, lift}));
}

class JointPathFile : public ::testing::Test {
 protected:
  JointPath load(const std::string& name, const std::string& text,
                 PathInterpolation interpolation = PathInterpolation::Linear) const {
    return load_joint_path(directory_.write(name, text), make_arm(), interpolation);
  }
  testing::TemporaryDirectory directory_;
};

TEST_F(JointPathFile, ReadsColumnsInAnyOrder) {
  const JointPath path = load("p.csv", "t, lift, turn\n1, 2, 0\n3, 3, 1 # the end\n");
  EXPECT_EQ(path.domain().begin, 1);
  EXPECT_EQ(path.position(2), JointVector((JointVector(2) << 0.5, 2.5).finished()));
}

TEST_F(JointPathFile, ReadsWhatSpreadsheetsWrite) {
  const JointPath path = load("p.csv", "\xEF\xBB\xBFTime;turn;lift\r\n1;0;2\r\n3;1;3\r\n");
  EXPECT_EQ(path.position(2), JointVector((JointVector(2) << 0.5, 2.5).finished()));
  // Decimal commas are no second separator.
  EXPECT_THROW(load("p.csv", "turn;lift\n0;2\n0,5;3\n"), FileError);
  EXPECT_THROW(load("p.csv", "turn;lift\n0;2\n0,5\n"), FileError);
}

TEST_F(JointPathFile, JointsThatAreNotNamedRestWithinTheirLimits) {
  const JointPath path = load("p.csv", "turn\n0\n1\n");
  EXPECT_EQ(path.position(1), JointVector((JointVector(2) << 1, 2).finished()));
}

TEST_F(JointPathFile, CubicsUseTheVelocitiesOfAMessage) {
  const char* text = R"({"joint_trajectory": {"joint_names": ["turn"], "points": [
    {"positions": [0], "velocities": [3], "time_from_start": {"secs": 0, "nsecs": 0}},
    {"positions": [1], "velocities": [-2], "time_from_start": {"secs": 0, "nsecs": 500000000}}]}})";
  const JointPath path = load("p.json", text, PathInterpolation::Cubic);
  EXPECT_EQ(path.domain().end, 0.5);
  EXPECT_NEAR(path.velocity(0)[0], 3, 1e-12);
  EXPECT_NEAR(path.velocity(0.5)[0], -2, 1e-12);
  EXPECT_EQ(load("p.json", text).degree(), 1u);
}

TEST_F(JointPathFile, ReadsMessagesInYaml) {
  const char* text = R"(joint_trajectory:
  joint_names: [lift]
  points:
    - positions: [2]
      velocities: [0.5]
      accelerations: [4]
      time_from_start: {sec: 0, nanosec: 0}
    - positions: [3]
      velocities: [-1]
      accelerations: [0]
      time_from_start:
        sec: 2
        nanosec: 0
)";
  const JointPath path = load("p.yaml", text, PathInterpolation::Quintic);
  EXPECT_EQ(path.degree(), 5u);
  EXPECT_EQ(path.position(0)[0], 0);
  EXPECT_EQ(path.position(2)[1], 3);
  EXPECT_NEAR(path.velocity(2)[1], -1, 1e-14);
  const JointVector rest = (JointVector(2) << 0.7, 2.5).finished();
  const auto file = directory_.path() / "p.yaml";
  const JointPath resting = load_joint_path(file, make_arm(), PathInterpolation::Linear, rest);
  EXPECT_EQ(resting.position(1)[0], 0.7);
  EXPECT_THROW(load_joint_path(file, make_arm(), {}, JointVector(JointVector::Zero(1))),
               InvalidArgument);
  // A planner's answer, which holds one robot trajectory.
  EXPECT_EQ(load("q.yml",
                 "trajectory: [{joint_trajectory: {joint_names: [lift], points: "
                 "[{positions: [2]}, {positions: [3]}]}}]")
                .degree(),
            1u);
}

TEST_F(JointPathFile, NamesWhatItCannotRead) {
  EXPECT_THROW(load("p.csv", "turn\n0\n1\n", PathInterpolation::Quintic), FileError);
  EXPECT_THROW(load("p.yaml",
                    "joint_names: [turn]\npoints: [{positions: [0]}, {positions: [1], "
                    "accelerations: [1]}]"),
               FileError);
  EXPECT_THROW(load("p.csv", "1 2 3\n1 2 3\n"), FileError);
  EXPECT_THROW(load("p.json", "turn\n0\n1\n"), FileError);
  EXPECT_THROW(load_joint_path(directory_.path() / "none.csv", make_arm()), FileError);
}

}  // namespace
}  // namespace dyop
