// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <tuple>
#include <vector>

#include "core/tolerance.h"
#include "dyop/motion/check_motion.h"
#include "motion/motion_maker.h"
#include "motion/motion_test_tools.h"

/// The tests that every Motion must pass, for a list of makers: included once per test program,
/// which says INSTANTIATE_TEST_SUITE_P(All, MotionContract, all_of(<makers>), test_name).
namespace dyop::testing {

struct NamedScales {
  const char* name;
  Scalar length;
  Scalar distance;
  TimeInterval span;
};

inline const NamedScales kScales[] = {
    {"unit", 1, 1, {0, 1}},
    {"micro", 1e-4, 1e-4, {0, 1e-3}},
    {"macro", 1e4, 1e4, {-300, 700}},
    {"far", 1, 1e6, {1000, 1001}},
    {"far_micro", 1e-4, 1e2, {-1e-2, -8e-3}},
};

inline const Scalar kTurns[] = {0, 1e-6, 1e-2, 1, 6, 40};

class MotionContract : public ::testing::TestWithParam<std::tuple<MotionMaker, NamedScales>> {
 protected:
  using Check = std::function<void(Random&, const Motion&, const Scales&)>;

  // Runs `check` on many random motions of the parameter's kind.
  static void for_many(const Check& check) {
    const auto& [maker, named] = GetParam();
    Random random(20240607);
    for (const Scalar turn : kTurns) {
      for (int i = 0; i < 6; ++i) {
        SCOPED_TRACE(::testing::Message() << "turn " << turn << ", motion " << i);
        const Scales scales{named.length, named.distance, turn, named.span};
        check(random, *maker.make(random, scales), scales);
        if (HasFailure()) return;
      }
    }
  }

  // Step of differences that is small for everything the motion does.
  static Scalar difference_step(const Scales& scales) {
    return scales.time() / (64 * (1 + 4 * scales.turn));
  }

  static TimeInterval random_part(Random& random, const TimeInterval& whole) {
    const Scalar length = whole.length() * std::pow(10.0, random.uniform(-3, 0));
    const Scalar begin = whole.begin + random.uniform(0, 1) * (whole.length() - length);
    return {begin, std::min(begin + length, whole.end)};
  }

  static Scalar time_in(Random& random, const TimeInterval& interval) {
    return std::clamp(random.uniform(interval.begin, interval.end), interval.begin, interval.end);
  }
};

TEST_P(MotionContract, CheckMotionFindsNothingWrong) {
  for_many([](Random& random, const Motion& motion, const Scales& scales) {
    const MotionCheckOptions options{.sample_count = 60,
                                     .seed = static_cast<std::uint64_t>(random.uniform(0, 1e9))};
    const MotionCheck whole = check_motion(motion, scales.span, options);
    ASSERT_TRUE(whole.is_sound()) << whole.message;
    const MotionCheck part = check_motion(motion, random_part(random, scales.span), options);
    ASSERT_TRUE(part.is_sound()) << part.message;
  });
}

TEST_P(MotionContract, PoseIsARotationToTheLastBits) {
  for_many([](Random& random, const Motion& motion, const Scales& scales) {
    for (int i = 0; i < 50; ++i) {
      const Matrix3 R = motion.pose(time_in(random, scales.span)).rotation();
      ASSERT_LT((R.transpose() * R - Matrix3::Identity()).cwiseAbs().maxCoeff(),
                64 * kUnitRoundoff);
    }
  });
}

TEST_P(MotionContract, TwistIsTheDerivativeOfPose) {
  int checked = 0;
  for_many([&](Random& random, const Motion& motion, const Scales& scales) {
    const Scalar step = difference_step(scales);
    const TwistBound whole = motion.twist_bound(scales.span);
    for (int i = 0; i < 40; ++i) {
      const Scalar t = random.uniform(scales.span.begin + 3 * step, scales.span.end - 3 * step);
      if (motion.smooth_until(t - 3 * step) < t + 3 * step) continue;
      ++checked;
      const Twist exact = motion.twist(t);
      const Twist numeric = twist_by_differences(motion, t, step);
      // Rounding of poses and of the times; 1e-8 for the truncation.
      const Scalar time_noise = 16 * kUnitRoundoff * std::abs(t) / step;
      ASSERT_LE((exact.v_WB - numeric.v_WB).norm(),
                (1e-8 + time_noise) * whole.linear_speed +
                    32 * kUnitRoundoff * (scales.distance + scales.length) / step)
          << "at " << t;
      ASSERT_LE((exact.w_WB - numeric.w_WB).norm(),
                (1e-8 + time_noise) * whole.angular_speed + 64 * kUnitRoundoff / step)
          << "at " << t;
    }
  });
  EXPECT_GT(checked, 700) << "too few times away from jumps";
}

TEST_P(MotionContract, AccelerationBoundsHoldOnEveryPart) {
  int checked = 0;
  for_many([&](Random& random, const Motion& motion, const Scales& scales) {
    const TwistBound whole = motion.twist_bound(scales.span);
    for (int i = 0; i < 30; ++i) {
      const TimeInterval part = random_part(random, scales.span);
      const TwistBound bound = motion.twist_bound(part);
      const Scalar step = std::min(difference_step(scales), part.length() / 16);
      for (int k = 0; k < 12; ++k) {
        const Scalar t = random.uniform(part.begin + 3 * step, part.end - 3 * step);
        if (motion.smooth_until(t - 3 * step) < t + 3 * step) continue;
        ++checked;
        const Scalar a =
            differentiate([&](Scalar x) { return motion.twist(x).v_WB; }, t, step).norm();
        const Scalar alpha =
            differentiate([&](Scalar x) { return motion.twist(x).w_WB; }, t, step).norm();
        // Rounding of twists, and of the times at which they are taken.
        const Scalar noise = 64 * kUnitRoundoff / step;
        const Scalar late = std::abs(t) + scales.time();
        const Scalar a_late = bound.linear_acceleration * late;
        const Scalar alpha_late = bound.angular_acceleration * late;
        ASSERT_LE(a, bound.linear_acceleration * (1 + 1e-8) +
                         noise * (whole.linear_speed + (std::isfinite(a_late) ? a_late : 0)));
        ASSERT_LE(alpha,
                  bound.angular_acceleration * (1 + 1e-8) +
                      noise * (whole.angular_speed + (std::isfinite(alpha_late) ? alpha_late : 0)));
      }
    }
  });
  EXPECT_GT(checked, 4000) << "too few times away from jumps";
}

TEST_P(MotionContract, BoundsOfAPartAreNotAboveThoseOfTheWhole) {
  for_many([](Random& random, const Motion& motion, const Scales& scales) {
    for (int i = 0; i < 50; ++i) {
      const TimeInterval outer = random_part(random, scales.span);
      const TwistBound x = motion.twist_bound(random_part(random, outer));
      const TwistBound y = motion.twist_bound(outer);
      const Scalar up = 1 + 1e-9;
      ASSERT_LE(x.linear_speed, up * y.linear_speed);
      ASSERT_LE(x.angular_speed, up * y.angular_speed);
      ASSERT_LE(x.linear_acceleration, up * y.linear_acceleration);
      ASSERT_LE(x.angular_acceleration, up * y.angular_acceleration);
    }
  });
}

TEST_P(MotionContract, TwistIsLipschitzUntilSmoothUntil) {
  for_many([](Random& random, const Motion& motion, const Scales& scales) {
    const TwistBound whole = motion.twist_bound(scales.span);
    for (int i = 0; i < 30; ++i) {
      const Scalar t = time_in(random, scales.span);
      ASSERT_GT(motion.smooth_until(t), t);
      const Scalar end = std::min(motion.smooth_until(t), scales.span.end);
      const TwistBound bound = motion.twist_bound({t, end});
      ASSERT_TRUE(std::isfinite(bound.linear_acceleration));
      ASSERT_TRUE(std::isfinite(bound.angular_acceleration));
      const Scalar s = (end - t) * random.uniform(0, 0.999);
      const Twist x = motion.twist(t);
      const Twist y = motion.twist(t + s);
      const Scalar late = 8 * kUnitRoundoff * std::abs(t);
      ASSERT_LE((y.v_WB - x.v_WB).norm(),
                bound.linear_acceleration * (s + late) + 1e-13 * whole.linear_speed);
      ASSERT_LE((y.w_WB - x.w_WB).norm(),
                bound.angular_acceleration * (s + late) + 1e-13 * whole.angular_speed);
    }
  });
}

TEST_P(MotionContract, DomainHoldsTheSpanAndNothingBeyondIsPromised) {
  for_many([](Random&, const Motion& motion, const Scales& scales) {
    ASSERT_NO_THROW(require_defined(motion, scales.span, "motion"));
    const TimeInterval domain = motion.domain();
    if (std::isfinite(domain.end)) {
      ASSERT_THROW(require_defined(motion, {domain.begin, domain.end + scales.time()}, "motion"),
                   InvalidArgument);
      ASSERT_EQ(motion.smooth_until(domain.end), kInfinity);
    }
  });
}

// The two facts that the impact engine builds on; derivation in docs/algorithms/motions.md.
TEST_P(MotionContract, DisplacementsStayWithinTheSecondOrderBound) {
  for_many([](Random& random, const Motion& motion, const Scales& scales) {
    for (int i = 0; i < 60; ++i) {
      const Scalar t = time_in(random, scales.span);
      const Scalar end = std::min(motion.smooth_until(t), scales.span.end);
      const Scalar t1 = time_in(random, {t, end});
      const Scalar s = t1 - t;
      const TwistBound bound = motion.twist_bound({t, t1});
      const Scalar r = scales.length;
      const Vector3 p_B = random.in_ball(r);
      const Vector3 n_W = random.direction();
      const RigidPose begin = motion.pose(t);
      const RigidPose later = motion.pose(t1);
      const Twist twist = motion.twist(t);
      const Vector3 p_W = begin.rotation() * p_B;
      const Vector3 moved = later * p_B - begin * p_B;
      const Scalar noise =
          kPoseNoise * (2 * scales.distance + 2 * scales.length + r +
                        (bound.linear_speed + bound.angular_speed * r) * std::abs(t1));
      const Scalar w_max = bound.angular_speed;
      const Scalar curvature =
          bound.linear_acceleration + (bound.angular_acceleration + w_max * w_max) * r;
      const Scalar speed = n_W.dot(twist.v_WB) + p_W.dot(n_W.cross(twist.w_WB));
      ASSERT_LE(n_W.dot(moved), s * speed + s * s / 2 * curvature + noise);
      const Vector3 steady =
          begin.translation() + s * twist.v_WB + rotation_from_vector(s * twist.w_WB) * p_W;
      ASSERT_LE((later * p_B - steady).norm(),
                s * s / 2 * (bound.linear_acceleration + bound.angular_acceleration * r) + noise);
    }
  });
}

inline std::string test_name(
    const ::testing::TestParamInfo<std::tuple<MotionMaker, NamedScales>>& info) {
  return std::string(std::get<0>(info.param).name) + "_" + std::get<1>(info.param).name;
}

// The makers, each at every scale.
inline auto all_of(const std::vector<MotionMaker>& makers) {
  return ::testing::Combine(::testing::ValuesIn(makers), ::testing::ValuesIn(kScales));
}

}  // namespace dyop::testing
