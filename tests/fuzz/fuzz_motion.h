// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "dyop/motion/bezier_motion.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/steady_motions.h"
#include "fuzz/fuzz_input.h"

namespace dyop::fuzz {

/// Largest numbers of a motion.
struct MotionLimits {
  Scalar length = 16;  ///< of coordinates; also of velocities
  Scalar turn = 16;    ///< of rotation vectors and angular velocities
};

/// An interval of time with its ends within `limit`, in order.
inline TimeInterval read_interval(Input& in, Scalar limit) {
  const Scalar x = in.number_within(limit);
  const Scalar y = in.number_within(limit);
  return {std::min(x, y), std::max(x, y)};
}

inline Twist read_twist(Input& in, const MotionLimits& limits) {
  const Vector3 v = in.vector_within(limits.length);
  return {v, in.vector_within(limits.turn)};
}

inline HermiteNode read_node(Input& in, const MotionLimits& limits) {
  HermiteNode node;
  node.p_WB = in.vector_within(limits.length);
  node.v_WB = in.vector_within(limits.length);
  node.theta = in.vector_within(limits.turn);
  node.theta_rate = in.vector_within(limits.turn);
  return node;
}

/// A motion of any kind of the library, defined on all of `span`.
/// @throws InvalidArgument where the motion refuses its input.
inline std::shared_ptr<const Motion> read_motion(Input& in, const TimeInterval& span,
                                                 const MotionLimits& limits, int depth = 0) {
  const auto pose = [&] { return in.pose_within(limits.length); };
  switch (in.index(depth < 2 ? 11 : 10)) {
    case 0:
      return std::make_shared<RestMotion>(pose());
    case 1: {
      const RigidPose X = pose();
      return std::make_shared<ConstantTwistMotion>(X, read_twist(in, limits), span.begin);
    }
    case 2: {
      const RigidPose X = pose();
      ScrewMotion::Screw screw;
      screw.p_WA = in.vector_within(limits.length);
      screw.axis_W = in.vector_within(limits.length);
      screw.turn_rate = in.number_within(limits.turn);
      screw.slide_rate = in.number_within(limits.length);
      return std::make_shared<ScrewMotion>(X, screw, in.number_within(limits.turn));
    }
    case 3: {
      const RotationPath path = in.flag() ? RotationPath::Slerp : RotationPath::RotationVector;
      const RigidPose X = pose();
      return std::make_shared<InterpolatedMotion>(span, X, pose(), path);
    }
    case 4: {
      const Matrix3 R = pose().rotation();
      const HermiteNode begin = read_node(in, limits);
      const HermiteNode end = read_node(in, limits);
      return std::make_shared<InterpolatedMotion>(InterpolatedMotion::from_chart(
          span, R, {begin.p_WB, begin.theta}, {end.p_WB, end.theta}));
    }
    case 5: {
      std::vector<SampledMotion::Sample> samples{{span.begin, pose()}};
      for (int k = in.index(6); k > 0; --k) {
        const Scalar part = Scalar(in.byte()) / 256;
        const Scalar last = samples.back().t;
        samples.push_back({last + part * (span.end - last), pose()});
      }
      samples.push_back({span.end, pose()});
      return std::make_shared<SampledMotion>(samples);
    }
    case 6: {
      const RigidPose X = pose();
      const Twist begin = read_twist(in, limits);
      const RigidPose Y = pose();
      return std::make_shared<HermiteMotion>(span, MotionState{X, begin},
                                             MotionState{Y, read_twist(in, limits)});
    }
    case 7: {
      const Matrix3 R = pose().rotation();
      const HermiteNode begin = read_node(in, limits);
      return std::make_shared<HermiteMotion>(
          HermiteMotion::from_chart(span, R, begin, read_node(in, limits)));
    }
    case 8: {
      const Matrix3 R = pose().rotation();
      std::vector<ControlPoint> points(std::size_t(2 + in.index(BezierMotion::kMaxDegree)));
      for (ControlPoint& point : points) {
        point.p_WB = in.vector_within(limits.length);
        point.theta = in.vector_within(limits.turn);
      }
      return std::make_shared<BezierMotion>(span, R, points);
    }
    case 9: {
      std::vector<SampledMotion::Sample> samples{{span.begin, pose()}};
      const Scalar middle = span.begin + span.length() * Scalar(in.byte()) / 256;
      samples.push_back({middle, pose()});
      samples.push_back({span.end, pose()});
      return std::make_shared<SequenceMotion>(smooth_sampled_motion(samples));
    }
    default: {
      auto carrier = read_motion(in, span, limits, depth + 1);
      return std::make_shared<ComposedMotion>(std::move(carrier),
                                              read_motion(in, span, limits, depth + 1));
    }
  }
}

}  // namespace dyop::fuzz
