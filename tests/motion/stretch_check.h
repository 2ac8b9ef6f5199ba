// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "core/tolerance.h"
#include "dyop/motion/motion.h"
#include "support/inputs/random_inputs.h"

/// Motion::stretch() against dense samples of the motion.
namespace dyop::testing {

/// The largest |(R - S) x| of unit vectors x.
inline Scalar turned_away(const Matrix3& R, const Matrix3& S) {
  return (R - S).jacobiSvd().singularValues()[0];
}

/// Every stretch known at t.
inline std::vector<MotionStretch> stretches_at(const Motion& motion, Scalar t) {
  std::vector<MotionStretch> stretches;
  Scalar after = motion.smooth_until(t);
  while (const auto stretch = motion.stretch(t, after)) {
    EXPECT_GT(stretch->end, after);
    after = stretch->end;
    stretches.push_back(*stretch);
    if (stretches.size() > 100) break;
  }
  return stretches;
}

inline void expect_stretch(const Motion& motion, Scalar t, const MotionStretch& stretch, Scalar s) {
  const RigidPose from = motion.pose(t);
  const RigidPose to = motion.pose(t + s);
  const Scalar exact = (t + s) - t;
  const Twist& twist = stretch.twist;
  const TimeInterval part{t, t + s};
  const PoseScale scale = motion.pose_scale(part);
  const TwistBound bound = motion.twist_bound(motion.domain());
  const Scalar late = 4 * kUnitRoundoff * (std::abs(t) + s);
  const Scalar strayed = (to.translation() - from.translation() - exact * twist.v_WB).norm();
  ASSERT_LE(strayed, stretch.linear_deviation +
                         exact * exact / 2 * stretch.linear_acceleration * (1 + 1e-9) +
                         2 * kPoseNoise * scale.length + late * bound.linear_speed)
      << "from " << t << " for " << s << " of " << stretch.end - t;
  const Matrix3 steady = rotation_from_vector(exact * twist.w_WB) * from.rotation();
  ASSERT_LE(
      turned_away(to.rotation(), steady),
      stretch.angular_deviation + exact * exact / 2 * stretch.angular_acceleration * (1 + 1e-9) +
          2 * kPoseNoise * (scale.angle + exact * twist.w_WB.norm()) + late * bound.angular_speed)
      << "from " << t << " for " << s << " of " << stretch.end - t;
}

/// From random times and from stamps, to random times and to stamps.
inline void expect_stretches(const Motion& motion, const std::vector<Scalar>& stamps,
                             std::mt19937_64& random) {
  const TimeInterval domain = motion.domain();
  const auto any_stamp = [&] {
    return stamps[std::size_t(random_index(int(stamps.size()), random))];
  };
  std::size_t found = 0;
  for (int i = 0; i < 20; ++i) {
    if (::testing::Test::HasFatalFailure()) return;
    const Scalar t = i % 3 == 0 ? any_stamp() : random_number(domain.begin, domain.end, random);
    for (const MotionStretch& stretch : stretches_at(motion, t)) {
      ++found;
      const Scalar end = std::min(stretch.end, domain.end);
      ASSERT_LE(stretch.angular_deviation, 2);
      for (int k = 0; k < 25; ++k) {
        const Scalar s = std::min(random_number(0, end - t, random), end - t);
        expect_stretch(motion, t, stretch, s);
      }
      for (int k = 0; k < 25; ++k) {
        const Scalar stamp = any_stamp();
        if (stamp > t && stamp <= end) expect_stretch(motion, t, stretch, stamp - t);
      }
    }
  }
  EXPECT_GT(found, 5u);
}

}  // namespace dyop::testing
