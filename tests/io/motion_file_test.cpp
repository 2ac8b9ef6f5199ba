// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/motion_file.h"

#include <gtest/gtest.h>

#include <numbers>

#include "dyop/io/file_error.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

class MotionFile : public ::testing::Test {
 protected:
  std::shared_ptr<const Motion> load(const std::string& text) const {
    return load_motion(directory_.write("motion.json", text));
  }
  std::string message_of(const std::string& text) const {
    try {
      load(text);
    } catch (const FileError& error) {
      const std::string file = (directory_.path() / "motion.json").string();
      EXPECT_TRUE(std::string(error.what()).starts_with(file)) << error.what();
      return std::string(error.what()).substr(file.size());
    }
    return "no error";
  }

  testing::TemporaryDirectory directory_;
};

// A quarter turn about z takes (1, 0, 0) to (0, 1, 0).
constexpr const char* kQuarterTurn = R"({"axis_angle": {"axis": [0, 0, 2], "degrees": 90}})";

TEST_F(MotionFile, ReadsEveryWayToGiveARotation) {
  for (const std::string& pose :
       {std::string(kQuarterTurn), std::string(R"({"euler_degrees": [0, 0, 90]})"),
        std::string(R"({"quaternion": [0.7071067811865476, 0, 0, 0.7071067811865476]})")}) {
    const auto motion = load(R"({"kind": "rest", "pose": )" + pose + "}");
    EXPECT_TRUE((motion->pose(0) * Vector3::UnitX()).isApprox(Vector3::UnitY())) << pose;
  }
}

// First about x, then about y, then about z, all fixed in the world: z goes to -y (x by 90), stays
// (y by 90 about its own axis), and -y goes to x (z by 90).
TEST_F(MotionFile, TurnsEulerAnglesAboutFixedAxes) {
  const auto motion = load(R"({"kind": "rest", "pose": {"euler_degrees": [90, 90, 90]}})");
  EXPECT_TRUE((motion->pose(0) * Vector3::UnitZ()).isApprox(Vector3::UnitX()));
}

TEST_F(MotionFile, ReadsEveryKind) {
  const auto twist = load(R"({"kind": "constant_twist", "time": 1, "pose": {"position": [1, 2, 3]},
                              "velocity": {"linear": [1, 0, 0], "angular": [0, 0, 2]}})");
  EXPECT_TRUE(twist->pose(3).translation().isApprox(Vector3(3, 2, 3)));
  EXPECT_EQ(twist->twist(0).w_WB, Vector3(0, 0, 2));

  const auto screw = load(R"({"kind": "screw", "pose": {"position": [1, 0, 0]}, "point": [0, 0, 0],
                              "axis": [0, 0, 1], "turn_rate": 1, "slide_rate": 5})");
  EXPECT_TRUE(
      screw->pose(std::numbers::pi).translation().isApprox(Vector3(-1, 0, 5 * std::numbers::pi)));

  for (const char* path : {"slerp", "rotation_vector"}) {
    const auto between =
        load(R"({"kind": "interpolated", "interval": [2, 4], "path": ")" + std::string(path) +
             R"(", "from": {}, "to": {"position": [2, 0, 0]}})");
    EXPECT_TRUE(between->pose(3).translation().isApprox(Vector3(1, 0, 0)));
  }

  const auto sampled = load(R"({"kind": "sampled", "samples": [
      {"time": 0, "pose": {}}, {"time": 1, "pose": {"position": [1, 0, 0]}},
      {"time": 3, "pose": {"position": [1, 4, 0]}}]})");
  EXPECT_TRUE(sampled->pose(2).translation().isApprox(Vector3(1, 2, 0)));

  // At the middle of a cubic with equal ends and opposite velocities v: T v / 4 = 0.5.
  const auto hermite = load(R"({"kind": "hermite", "interval": [0, 2],
      "from": {"pose": {}, "velocity": {"linear": [1, 0, 0]}},
      "to": {"pose": {}, "velocity": {"linear": [-1, 0, 0]}}})");
  EXPECT_TRUE(hermite->pose(1).translation().isApprox(Vector3(0.5, 0, 0)));

  // Samples of t^2: the smooth motion is this parabola.
  const auto smooth = load(R"({"kind": "sampled", "smooth": true, "samples": [
      {"time": 0, "pose": {}}, {"time": 1, "pose": {"position": [1, 0, 0]}},
      {"time": 3, "pose": {"position": [9, 0, 0]}}]})");
  EXPECT_TRUE(smooth->pose(2).translation().isApprox(Vector3(4, 0, 0)));

  // At the middle of a parabola: a quarter of the ends and half of the middle control point.
  const auto bezier = load(R"({"kind": "bezier", "interval": [0, 2], "base": )" +
                           std::string(kQuarterTurn) + R"(, "control_points": [{},
      {"position": [2, 0, 0]}, {"position": [4, 4, 0], "rotation_vector": [0, 0, 1]}]})");
  EXPECT_TRUE(bezier->pose(1).translation().isApprox(Vector3(2, 1, 0)));
  EXPECT_TRUE((bezier->pose(0) * Vector3::UnitX()).isApprox(Vector3::UnitY()));

  const auto bspline = load(R"({"kind": "bspline", "degree": 1, "knots": [0, 0, 1, 3, 3],
      "control_points": [{}, {"position": [1, 0, 0]}, {"position": [1, 4, 0]}]})");
  EXPECT_TRUE(bspline->pose(2).translation().isApprox(Vector3(1, 2, 0)));

  const auto sequence = load(R"({"kind": "sequence", "parts": [
      {"interval": [0, 2], "motion": {"kind": "rest"}},
      {"interval": [2, 3], "motion": {"kind": "constant_twist", "time": 2,
                                      "velocity": {"linear": [5, 0, 0]}}}]})");
  EXPECT_TRUE(sequence->pose(3).translation().isApprox(Vector3(5, 0, 0)));

  const auto composed = load(R"({"kind": "composed",
      "carrier": {"kind": "rest", "pose": {"position": [0, 0, 7]}},
      "relative": {"kind": "constant_twist", "velocity": {"linear": [1, 0, 0]}}})");
  EXPECT_TRUE(composed->pose(2).translation().isApprox(Vector3(2, 0, 7)));
}

TEST_F(MotionFile, NamesTheKeyOfWhatIsWrong) {
  EXPECT_EQ(message_of(R"({"kind": "flying"})"),
            ": kind: expected one of rest, constant_twist, screw, interpolated, sampled, hermite, "
            "bezier, bspline, sequence, composed, found \"flying\"");
  EXPECT_EQ(message_of(R"({"pose": {}})"), ": the key 'kind' is missing");
  EXPECT_NE(message_of(R"({"kind": "rest", "pose": {"quaternion": [1, 1, 0, 0]}})")
                .find(": pose.quaternion: pose rotation must be a unit quaternion"),
            std::string::npos);
  EXPECT_EQ(message_of(R"({"kind": "rest", "pose": {"quaternion": [1, 0, 0]}})"),
            ": pose.quaternion: expected four numbers [w, x, y, z], found [1,0,0]");
  EXPECT_NE(message_of(R"({"kind": "interpolated", "interval": [2, 1], "from": {}, "to": {}})")
                .find(": interval: time interval must not be reversed: begin 2 > end 1"),
            std::string::npos);
  EXPECT_NE(message_of(R"({"kind": "sampled", "samples": [{"time": 1, "pose": {}},
                                                          {"time": 0, "pose": {}}]})")
                .find(": samples: "),
            std::string::npos);
  EXPECT_EQ(message_of(R"({"kind": "sampled", "samples": [{"time": 1, "pose": {}}]})"),
            ": samples: expected at least 2 elements, found 1");
  EXPECT_EQ(message_of(R"({"kind": "rest", "pose": {"quaternion": [1, 0, 0, 0],
                                                    "euler_degrees": [0, 0, 0]}})"),
            ": pose: expected at most one of quaternion, axis_angle, euler_degrees");
  EXPECT_EQ(message_of(R"({"kind": "rest", "pose": {"axis_angle": {"axis": [0, 0, 0],
                                                                   "degrees": 1}}})"),
            ": pose.axis_angle.axis: expected an axis of nonzero length, found [0,0,0]");
  EXPECT_EQ(message_of(R"({"kind": "bspline", "degree": 2.5, "knots": [0, 0, 1, 1],
                           "control_points": [{}, {}]})"),
            ": degree: expected an integer > 0, found 2.5");
  EXPECT_EQ(message_of(R"({"kind": "sequence", "parts": [
                {"interval": [0, 1], "motion": {"kind": "rest"}},
                {"interval": [1, 2], "motion": {"kind": "rest", "pose": {"position": [1, 0, 0]}}}
            ]})"),
            ": parts 0 and 1 of sequence motion do not meet at time 1: the position jumps by 1, "
            "the rotation matrix by 0");
  EXPECT_EQ(message_of("[1]"), ": expected an object, found [1]");
}

TEST_F(MotionFile, RefusesBottomlessNesting) {
  std::string text = R"({"kind": "rest"})";
  for (int k = 0; k < 1000; ++k) {
    text = R"({"kind": "composed", "relative": {"kind": "rest"}, "carrier": )" + text + "}";
  }
  EXPECT_NE(message_of(text).find("nested too deeply"), std::string::npos);
}

}  // namespace
}  // namespace dyop
