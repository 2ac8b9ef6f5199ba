// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/joint_path_file.h"

#include <gtest/gtest.h>

#include "dyop/geometry/sphere.h"
#include "dyop/io/file_error.h"
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

TEST_F(JointPathFile, NamesWhatItCannotRead) {
  EXPECT_THROW(load("p.csv", "1 2 3\n1 2 3\n"), FileError);
  EXPECT_THROW(load("p.json", "turn\n0\n1\n"), FileError);
  EXPECT_THROW(load_joint_path(directory_.path() / "none.csv", make_arm()), FileError);
}

}  // namespace
}  // namespace dyop
