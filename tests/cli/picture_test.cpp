// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "cli/command.h"
#include "cli/picture/gap_plot.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/primitives.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"

namespace dyop {
namespace {

using testing::CommandResult;
using testing::run_command;
using testing::TemporaryDirectory;

// A tumbling rod falls on a box; at several scales and far from the origin.
struct FallingRod {
  explicit FallingRod(Scalar scale, const Vector3& origin = Vector3::Zero())
      : rod(0.1 * scale, 0.8 * scale),
        box(scale * Vector3(0.3, 0.4, 0.5)),
        rod_motion(RigidPose(Vector3(origin + scale * Vector3(0.2, 0.1, 3))),
                   Twist{scale * Vector3(0, 0.1, -1), Vector3(3, 0.4, 0)}),
        box_motion(RigidPose(origin)) {
    query = {&rod, &rod_motion, &box, &box_motion, {0, 4}, {}};
  }
  Capsule rod;
  Box box;
  ConstantTwistMotion rod_motion;
  RestMotion box_motion;
  ToiQuery query;
};

TEST(GapHistory, StaysBelowTheGap) {
  for (const Scalar scale : {1e-4, 1.0, 1e4}) {
    const FallingRod scene(scale, 100 * scale * Vector3(1, -2, 3));
    const Scalar tolerance = 1e-6 * scale;
    const cli::GapHistory history = cli::gap_history(scene.query, tolerance, 50, 1000);
    EXPECT_FALSE(history.is_cut);
    ASSERT_GT(history.steps.size(), 5u);
    Scalar t = 0;
    for (const cli::GapStep& step : history.steps) {
      EXPECT_EQ(step.t, t);
      for (int k = 0; k <= 10; ++k) {
        const Scalar s = step.length * k / 10;
        const DistanceResult gap =
            distance(scene.rod, scene.rod_motion.pose(t + s), scene.box, scene.box_motion.pose(0));
        EXPECT_GE(gap.upper, step.lower - step.speed * s - 1e-12 * scale);
      }
      t += step.length;
    }
    // It comes as far as the engine does, up to what both tolerances close.
    const ToiResult result = time_of_impact(scene.rod, scene.rod_motion, scene.box,
                                            scene.box_motion, scene.query.interval);
    ASSERT_EQ(result.status, ToiStatus::Impact);
    EXPECT_NEAR(t, result.t_safe, 1e-5);
  }
}

TEST(GapHistory, SamplesTheWholeInterval) {
  const FallingRod scene(1);
  const cli::GapHistory history = cli::gap_history(scene.query, 1e-6, 9, 3);
  EXPECT_TRUE(history.is_cut);
  EXPECT_EQ(history.steps.size(), 3u);
  ASSERT_EQ(history.samples.size(), 9u);
  EXPECT_EQ(history.samples.front().t, 0);
  EXPECT_EQ(history.samples.back().t, 4);
  for (const cli::GapSample& sample : history.samples) EXPECT_LE(sample.lower, sample.upper);
}

class Picture : public ::testing::Test {
 protected:
  std::string path(const char* name) const { return (directory_.path() / name).string(); }
  CommandResult toi(const std::string& picture) const {
    return run_command({"toi",
                        "capsule:0.1,0.8",
                        "box:0.3,0.4,0.5",
                        "--position-a",
                        "0.2",
                        "0.1",
                        "3",
                        "--velocity-a",
                        "0",
                        "0.1",
                        "-1",
                        "--spin-a",
                        "3",
                        "0.4",
                        "0",
                        "--interval",
                        "0",
                        "4",
                        "--record",
                        path("query.json"),
                        "--picture",
                        picture});
  }
  // Everything that a picture of an impact shows.
  static void expect_impact(const std::string& svg) {
    for (const char* part : {"Impact at t = 1.8231", "data:image/png;base64,", "proven apart",
                             "steps of conservative advancement", "pivot", "t_safe, t_hit"}) {
      EXPECT_NE(svg.find(part), std::string::npos) << part;
    }
    // Two views, each with the two witness points.
    std::size_t images = 0;
    for (auto at = svg.find("<image"); at != std::string::npos; at = svg.find("<image", at + 1)) {
      ++images;
    }
    EXPECT_EQ(images, 2u);
    EXPECT_EQ(svg.find("nan"), std::string::npos);
  }
  TemporaryDirectory directory_;
};

TEST_F(Picture, OfAnImpactIsAnSvgFile) {
  ASSERT_EQ(toi(path("impact.svg")).exit_code, 0);
  const std::string svg = TemporaryDirectory::read(path("impact.svg"));
  EXPECT_TRUE(svg.starts_with("<svg "));
  expect_impact(svg);
}

TEST_F(Picture, OfARecordIsAPage) {
  ASSERT_EQ(toi(path("impact.svg")).exit_code, 0);
  ASSERT_EQ(run_command({"replay", path("query.json"), "--picture", path("again.html")}).exit_code,
            0);
  const std::string page = TemporaryDirectory::read(path("again.html"));
  EXPECT_TRUE(page.starts_with("<!doctype html>"));
  expect_impact(page);
  EXPECT_NE(page.find(TemporaryDirectory::read(path("impact.svg"))), std::string::npos);
}

TEST_F(Picture, OfADistanceHasNoTime) {
  const CommandResult result = run_command({"distance", "sphere:0.5", "box:1,1,1", "--position-a",
                                            "3", "0", "0", "--picture", path("distance.svg")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string svg = TemporaryDirectory::read(path("distance.svg"));
  EXPECT_NE(svg.find("proven apart."), std::string::npos);
  EXPECT_EQ(svg.find("conservative advancement"), std::string::npos);
}

std::size_t parts_in(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST_F(Picture, OfOverlappingShapesHasAPlaceButNoNormal) {
  const CommandResult result = run_command({"distance", "sphere:0.5", "box:1,1,1", "--position-a",
                                            "0.8", "0", "0", "--picture", path("overlap.svg")});
  EXPECT_NE(result.out.find("meet near"), std::string::npos) << result.out;
  EXPECT_EQ(result.out.find("on A"), std::string::npos) << result.out;
  EXPECT_EQ(result.out.find("normal"), std::string::npos) << result.out;
  const std::string svg = TemporaryDirectory::read(path("overlap.svg"));
  EXPECT_NE(svg.find("a place where they overlap"), std::string::npos);
  EXPECT_EQ(svg.find("from near"), std::string::npos);
  EXPECT_EQ(parts_in(svg, "<circle"), 0u);
}

// A sphere flies past a box at a height of 2: least distance 0.5, above the box's middle, at t = 3.
TEST_F(Picture, OfAMissTellsTheLeastDistanceAndWhere) {
  const CommandResult result =
      run_command({"toi", "sphere:0.5", "box:1,1,1", "--position-a", "-3", "0", "2", "--velocity-a",
                   "1", "0", "0", "--interval", "0", "6", "--picture", path("miss.svg")});
  ASSERT_EQ(result.exit_code, 0) << result.err << result.out;
  const std::string svg = TemporaryDirectory::read(path("miss.svg"));
  EXPECT_NE(svg.find("least"), std::string::npos);
  EXPECT_NE(svg.find("0.5 (sampled) at t = "), std::string::npos) << svg.substr(0, 2000);
  // The gap is as large as a part of the bodies: a second view would not be from nearer.
  EXPECT_EQ(parts_in(svg, "<image"), parts_in(svg, "from near") + 1);
}

TEST_F(Picture, IsAPngFileOrSaysWhyNot) {
  const CommandResult result = toi(path("impact.png"));
  if (result.exit_code == 2) {
    EXPECT_NE(result.err.find("librsvg"), std::string::npos) << result.err;
    return;
  }
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(TemporaryDirectory::read(path("impact.png")).starts_with("\x89PNG\r\n"));
}

TEST_F(Picture, IsRefusedBeforeTheWork) {
  const CommandResult result = toi(path("impact.bmp"));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.out, "");
  EXPECT_NE(result.err.find(".svg, .png or .html"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace dyop
