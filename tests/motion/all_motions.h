// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <vector>

#include "dyop/motion/bezier_motion.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/motion.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/steady_motions.h"
#include "motion/motion_maker.h"

/// One maker a motion; the contract test runs over kAllMotions.
namespace dyop::testing {

inline RigidPose random_pose(Random& random, const Scales& scales) {
  return random.pose(scales.distance);
}

inline RigidPose nearby_pose(Random& random, const Scales& scales, const RigidPose& X_WB) {
  const Matrix3 turn = rotation_from_vector(random.in_ball(std::fmin(scales.turn, 3)));
  return RigidPose(Matrix3(X_WB.rotation() * turn),
                   X_WB.translation() + random.in_ball(scales.length));
}

inline Twist random_twist(Random& random, const Scales& scales) {
  return {random.in_ball(scales.length / scales.time()),
          random.in_ball(scales.turn / scales.time())};
}

inline MotionPointer rest(Random& random, const Scales& scales) {
  return std::make_shared<RestMotion>(random_pose(random, scales));
}

inline MotionPointer constant_twist(Random& random, const Scales& scales) {
  return std::make_shared<ConstantTwistMotion>(random_pose(random, scales),
                                               random_twist(random, scales), scales.span.begin);
}

inline MotionPointer slerp(Random& random, const Scales& scales) {
  const RigidPose begin = random_pose(random, scales);
  return std::make_shared<InterpolatedMotion>(scales.span, begin,
                                              nearby_pose(random, scales, begin));
}

inline MotionPointer rotation_vector_path(Random& random, const Scales& scales) {
  const RigidPose begin = random_pose(random, scales);
  return std::make_shared<InterpolatedMotion>(
      scales.span, begin, nearby_pose(random, scales, begin), RotationPath::RotationVector);
}

inline MotionPointer rotation_chart_path(Random& random, const Scales& scales) {
  const Vector3 p_WB = random.in_ball(scales.distance);
  return std::make_shared<InterpolatedMotion>(InterpolatedMotion::from_chart(
      scales.span, random.rotation(), {p_WB, random.in_ball(scales.turn)},
      {p_WB + random.in_ball(scales.length), random.in_ball(scales.turn)}));
}

inline std::vector<SampledMotion::Sample> random_samples(Random& random, const Scales& scales) {
  const int count = 7;
  std::vector<SampledMotion::Sample> samples{{scales.span.begin, random_pose(random, scales)}};
  for (int i = 1; i <= count; ++i) {
    const Scalar fraction = (i + (i < count ? random.uniform(-0.4, 0.4) : 0)) / count;
    samples.push_back({i < count ? scales.span.begin + fraction * scales.time() : scales.span.end,
                       nearby_pose(random, scales, samples.back().X_WB)});
  }
  return samples;
}

inline MotionPointer sampled(Random& random, const Scales& scales) {
  return std::make_shared<SampledMotion>(random_samples(random, scales));
}

inline MotionPointer smooth_sampled(Random& random, const Scales& scales) {
  return std::make_shared<SequenceMotion>(smooth_sampled_motion(random_samples(random, scales)));
}

inline std::vector<ControlPoint> random_control_points(Random& random, const Scales& scales,
                                                       int count) {
  const Vector3 p_WB = random.in_ball(scales.distance);
  std::vector<ControlPoint> points;
  for (int i = 0; i < count; ++i) {
    points.push_back({p_WB + random.in_ball(scales.length), random.in_ball(scales.turn)});
  }
  return points;
}

// Degrees up to 6, for which the contract test's differences are exact.
inline MotionPointer bezier(Random& random, const Scales& scales) {
  const int count = 2 + static_cast<int>(random.uniform(0, 5.999));
  return std::make_shared<BezierMotion>(scales.span, random.rotation(),
                                        random_control_points(random, scales, count));
}

// Degree 3 on uneven knots, one of them double.
inline MotionPointer bspline(Random& random, const Scales& scales) {
  std::vector<Scalar> knots;
  for (const Scalar fraction : {-0.2, -0.1, 0.0, 0.0, 0.3, 0.55, 0.55, 0.8, 1.0, 1.0, 1.0, 1.0}) {
    knots.push_back(fraction == 1 ? scales.span.end : scales.span.begin + fraction * scales.time());
  }
  return std::make_shared<SequenceMotion>(
      bspline_motion(3, knots, random.rotation(), random_control_points(random, scales, 8)));
}

inline MotionPointer sequence(Random& random, const Scales& scales) {
  const Scalar middle = scales.span.begin + random.uniform(0.2, 0.8) * scales.time();
  const auto first = std::make_shared<ConstantTwistMotion>(
      random_pose(random, scales), random_twist(random, scales), scales.span.begin);
  const RigidPose meeting = first->pose(middle);
  const TimeInterval rest{middle, scales.span.end};
  const auto second = std::make_shared<HermiteMotion>(
      rest, MotionState{meeting, random_twist(random, scales)},
      MotionState{nearby_pose(random, scales, meeting), random_twist(random, scales)});
  return std::make_shared<SequenceMotion>(
      std::vector<SequenceMotion::Part>{{{scales.span.begin, middle}, first}, {rest, second}});
}

inline MotionPointer hermite(Random& random, const Scales& scales) {
  const RigidPose begin = random_pose(random, scales);
  return std::make_shared<HermiteMotion>(
      scales.span, MotionState{begin, random_twist(random, scales)},
      MotionState{nearby_pose(random, scales, begin), random_twist(random, scales)});
}

inline MotionPointer hermite_chart(Random& random, const Scales& scales) {
  const Twist begin = random_twist(random, scales);
  const Twist end = random_twist(random, scales);
  const Vector3 p_WB = random.in_ball(scales.distance);
  return std::make_shared<HermiteMotion>(HermiteMotion::from_chart(
      scales.span, random.rotation(),
      {p_WB, begin.v_WB, random.in_ball(random.uniform(0, 1) < 0.5 ? 0 : scales.turn), begin.w_WB},
      {p_WB + random.in_ball(scales.length), end.v_WB, random.in_ball(scales.turn), end.w_WB}));
}

inline MotionPointer screw(Random& random, const Scales& scales) {
  const RigidPose begin = random_pose(random, scales);
  const Vector3 p_WA = begin.translation() + random.in_ball(scales.length);
  return std::make_shared<ScrewMotion>(
      begin,
      ScrewMotion::Screw{p_WA, random.direction() * random.uniform(0.1, 10),
                         random.uniform(-1, 1) * scales.turn / scales.time(),
                         random.uniform(-1, 1) * scales.length / scales.time()},
      scales.span.begin);
}

/// p(t) = c + a sin(k t), R(t) = exp(b sin(k t)) R0 about a fixed axis; k t runs over one radian.
inline MotionPointer user(Random& random, const Scales& scales) {
  const RigidPose center = random_pose(random, scales);
  const Vector3 a = random.in_ball(scales.length);
  const Vector3 b = random.in_ball(scales.turn);
  const Scalar k = 1 / scales.time();
  const Scalar t0 = scales.span.begin;
  UserMotion::Functions functions;
  functions.pose = [=](Scalar t) {
    const Scalar s = std::sin(k * (t - t0));
    return RigidPose(Matrix3(rotation_from_vector(b * s) * center.rotation()),
                     center.translation() + a * s);
  };
  functions.twist = [=](Scalar t) {
    const Scalar c = k * std::cos(k * (t - t0));
    return Twist{a * c, b * c};
  };
  functions.twist_bound = [=](const TimeInterval&) {
    const Scalar up = 1 + 1e-14;  // rounding of the norms
    return TwistBound{up * a.norm() * k, up * b.norm() * k, up * a.norm() * k * k,
                      up * b.norm() * k * k};
  };
  return std::make_shared<UserMotion>(functions, scales.span);
}

inline MotionPointer composed(Random& random, const Scales& scales) {
  Scales near = scales;
  near.distance = scales.length;
  return std::make_shared<ComposedMotion>(hermite(random, scales), hermite_chart(random, near));
}

inline MotionPointer composed_with_jumps(Random& random, const Scales& scales) {
  Scales near = scales;
  near.distance = scales.length;
  return std::make_shared<ComposedMotion>(screw(random, scales), sampled(random, near));
}

inline const std::vector<MotionMaker> kAllMotions = {
    {"rest", rest},
    {"constant_twist", constant_twist},
    {"slerp", slerp},
    {"rotation_vector_path", rotation_vector_path},
    {"rotation_chart_path", rotation_chart_path},
    {"sampled", sampled},
    {"smooth_sampled", smooth_sampled},
    {"bezier", bezier},
    {"bspline", bspline},
    {"sequence", sequence},
    {"hermite", hermite},
    {"hermite_chart", hermite_chart},
    {"screw", screw},
    {"user", user},
    {"composed", composed},
    {"composed_with_jumps", composed_with_jumps},
};

}  // namespace dyop::testing
