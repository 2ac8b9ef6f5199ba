// SPDX-License-Identifier: BSD-3-Clause
// Motion::stretch() against dense samples of the motion.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <vector>

#include "dyop/motion/bezier_motion.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/steady_motions.h"
#include "motion/stretch_check.h"
#include "support/inputs/pose_logs.h"
#include "support/inputs/random_inputs.h"

namespace dyop::testing {
namespace {

using Shared = std::shared_ptr<const Motion>;

Shared sampled(const PoseLog& log) {
  return std::make_shared<SampledMotion>(log);
}
Shared smoothed(const PoseLog& log) {
  return std::make_shared<SequenceMotion>(smooth_sampled_motion(log));
}
Shared in_rotation_vectors(const PoseLog& log) {
  std::vector<SequenceMotion::Part> parts;
  for (std::size_t i = 0; i + 1 < log.size(); ++i) {
    const TimeInterval interval{log[i].t, log[i + 1].t};
    parts.push_back({interval, std::make_shared<InterpolatedMotion>(
                                   interval, log[i].X_WB, log[i + 1].X_WB, RotationPath::Slerp)});
  }
  return std::make_shared<SequenceMotion>(std::move(parts));
}
Shared spline(const PoseLog& log) {
  std::vector<Scalar> knots{log[0].t, log[0].t, log[0].t};
  std::vector<ControlPoint> points;
  for (const auto& [t, X_WB] : log) {
    knots.push_back(t);
    points.push_back({X_WB.translation(), rotation_vector(X_WB.rotation())});
  }
  points.push_back(points.back());
  points.push_back(points.back());
  knots.push_back(log.back().t);
  knots.push_back(log.back().t);
  knots.push_back(log.back().t);
  return std::make_shared<SequenceMotion>(bspline_motion(3, knots, Matrix3::Identity(), points));
}
// A log within the first half, rest in the second.
Shared nested(const PoseLog& log) {
  const TimeInterval whole{log.front().t, log.back().t};
  const TimeInterval rest{whole.end, whole.end + whole.length()};
  return std::make_shared<SequenceMotion>(std::vector<SequenceMotion::Part>{
      {whole, sampled(log)}, {rest, std::make_shared<RestMotion>(log.back().X_WB)}});
}

std::vector<Scalar> stamps_of(const PoseLog& log) {
  std::vector<Scalar> stamps;
  for (const SampledMotion::Sample& sample : log) stamps.push_back(sample.t);
  return stamps;
}

void expect_log(const Motion& motion, const PoseLog& log, std::mt19937_64& random) {
  expect_stretches(motion, stamps_of(log), random);
}

struct LogScale {
  Scalar step;
  Scalar distance;
  Scalar begin;
  Scalar span;
};

TEST(MotionStretch, HoldsForErraticLogs) {
  std::mt19937_64 random(28);
  const LogScale scales[] = {
      {1e-2, 0, 0, 1}, {1e-6, 1e-4, 0, 1e-3}, {1e2, 1e4, -300, 1e3}, {1e-2, 1e6, 1e3, 1}};
  for (const LogScale& scale : scales) {
    for (const Scalar turn : {0.0, 1e-3, 0.3}) {
      for (const std::size_t count : {9u, 17u, 18u, 200u}) {
        SCOPED_TRACE(::testing::Message()
                     << "step " << scale.step << ", distance " << scale.distance << ", turn "
                     << turn << ", count " << count);
        const PoseLog log = erratic_log(count, scale.step, turn, scale.begin, scale.span,
                                        Vector3(scale.distance, 0, -scale.distance), random);
        expect_log(*sampled(log), log, random);
        expect_log(*smoothed(log), log, random);
        expect_log(*in_rotation_vectors(log), log, random);
        expect_log(*spline(log), log, random);
        expect_log(*nested(log), log, random);
        if (HasFailure()) return;
      }
    }
  }
}

TEST(MotionStretch, HoldsForComposedMotions) {
  std::mt19937_64 random(29);
  for (const Scalar turn : {0.0, 0.02, 5.0}) {
    const PoseLog hand = erratic_log(100, 1e-2, turn / 50, 0, 1, Vector3(1, 2, 3), random);
    const PoseLog other = noisy(smooth_log(64, 0.3, turn), 1e-4, 1e-4, random);
    const Shared log = sampled(hand);
    const Shared flight = std::make_shared<HermiteMotion>(
        TimeInterval{0, 1}, MotionState{random_pose(1, random), {{1, 2, 3}, {turn, 0, 0}}},
        MotionState{random_pose(1, random), {{-1, 0, 1}, {0, 1, 0}}});
    const Shared fixed = std::make_shared<RestMotion>(random_pose(1, random));
    for (const Shared& second : {flight, fixed, sampled(other)}) {
      expect_log(ComposedMotion(log, second), hand, random);
      expect_log(ComposedMotion(second, log), hand, random);
      if (HasFailure()) return;
    }
  }
}

// Motions that are at the same pose at every knot, but not in between.
TEST(MotionStretch, HoldsBetweenKnots) {
  std::mt19937_64 random(31);
  const Vector3 out(0.3, -0.2, 0.1);
  for (const bool is_turn : {false, true}) {
    std::vector<SequenceMotion::Part> parts;
    PoseLog log;
    for (int i = 0; i < 16; ++i) {
      const TimeInterval interval{Scalar(i), Scalar(i + 1)};
      const std::vector<ControlPoint> points{
          {}, {is_turn ? Vector3::Zero() : out, is_turn ? out : Vector3::Zero()}, {}};
      parts.push_back({interval, std::make_shared<BezierMotion>(interval, RigidPose(), points)});
      log.push_back({Scalar(i), RigidPose()});
    }
    expect_log(SequenceMotion(std::move(parts)), log, random);
  }
}

// Once around a circle of radius one in unit time: a chord over h sags by (2 pi)^2 h^2 / 8.
TEST(MotionStretch, StraysLittleFromSmoothLogs) {
  const PoseLog log = smooth_log(4097, 1, 3);
  for (const Shared& motion : {sampled(log), smoothed(log)}) {
    std::size_t found = 0;
    for (const MotionStretch& stretch : stretches_at(*motion, 0)) {
      ++found;
      const Scalar h = stretch.end;
      EXPECT_LE(stretch.linear_deviation, 2 * 1.5 * 40 * h * h / 8 + 1e-6);
      EXPECT_LE(stretch.angular_deviation, 1e-4 + 1e-9);
    }
    EXPECT_EQ(found, 12u);
  }
}

// Noise adds to the deviation once, however many poses have it.
TEST(MotionStretch, DoesNotAddUpNoise) {
  std::mt19937_64 random(30);
  const Scalar noise = 1e-4;
  const PoseLog log = noisy(PoseLog(smooth_log(4097, 0, 0)), noise, noise, random);
  for (const MotionStretch& stretch : stretches_at(*sampled(log), 0)) {
    EXPECT_LE(stretch.linear_deviation, 4.1 * std::sqrt(3.0) * noise);
    EXPECT_LE(stretch.angular_deviation, 8 * std::sqrt(3.0) * noise);
  }
}

TEST(MotionStretch, IsUnknownBeyondTheEndAndForFewPieces) {
  const PoseLog log = smooth_log(33, 1, 1);
  EXPECT_FALSE(sampled(log)->stretch(0.5, 1));
  EXPECT_FALSE(smoothed(log)->stretch(0.5, 1));
  EXPECT_FALSE(sampled(smooth_log(5, 1, 1))->stretch(0, 0.25));
  EXPECT_FALSE(RestMotion().stretch(0, 1));
}

}  // namespace
}  // namespace dyop::testing
