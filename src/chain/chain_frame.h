// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"
#include "dyop/chain/kinematic_chain.h"
#include "dyop/chain/link_motion.h"
#include "dyop/motion/motion.h"
#include "motion/curve/chart_curve.h"

namespace dyop::chain_internal {

/// Sets the parts of the rotation exp(q axis_P) R_PJ, by Rodrigues' formula.
inline void set_turn(KinematicChain::Step& step) {
  const Matrix3& R = step.X_PJ.rotation();
  step.turn_fixed = step.axis_P * (step.axis_P.transpose() * R);
  step.turn_cosine = R - step.turn_fixed;
  for (int k = 0; k < 3; ++k) step.turn_sine.col(k) = step.axis_P.cross(R.col(k));
}

/// The rotation of a revolute joint, by the cosine and sine of its coordinate.
inline Matrix3 turn_at(const KinematicChain::Step& step, Scalar cosine, Scalar sine) {
  return step.turn_fixed + cosine * step.turn_cosine + sine * step.turn_sine;
}

/// The pose of a child link in its parent's frame.
inline RigidPose step_pose(const KinematicChain::Step& step, Scalar q) {
  switch (step.type) {
    case JointType::Fixed:
      break;
    case JointType::Revolute:
      return RigidPose::from_trusted(turn_at(step, std::cos(q), std::sin(q)),
                                     step.X_PJ.translation());
    case JointType::Prismatic:
      return RigidPose::from_trusted(step.X_PJ.rotation(),
                                     step.X_PJ.translation() + q * step.axis_P);
  }
  return step.X_PJ;
}

/// A link's frame on the way from the base to the tip, and how it moves.
struct ChainFrame {
  Matrix3 R = Matrix3::Identity();
  Vector3 p = Vector3::Zero();
  Twist twist;
};

/// A coordinate at one time; the sine and cosine are those of a revolute joint's value.
struct JointInstant {
  Scalar value = 0;
  Scalar rate = 0;
  Scalar cosine = 1;
  Scalar sine = 0;
};

inline JointInstant joint_instant(const JointPath& path, std::size_t coordinate, std::size_t piece,
                                  Scalar t) {
  const JointPath::Sample q = path.sample(coordinate, piece, t);
  return {q.value, q.rate, std::cos(q.value), std::sin(q.value)};
}

/// Past one more joint, towards the tip.
inline void advance(ChainFrame& frame, const KinematicChain::Step& step, const JointInstant& q) {
  const Vector3 axis = frame.R * step.axis_P;
  const bool is_prismatic = step.type == JointType::Prismatic;
  const Vector3 shift_P = is_prismatic ? Vector3(step.X_PJ.translation() + q.value * step.axis_P)
                                       : step.X_PJ.translation();
  const Vector3 shift = frame.R * shift_P;
  frame.p += shift;
  frame.twist.v_WB += frame.twist.w_WB.cross(shift);
  if (is_prismatic) {
    frame.twist.v_WB += q.rate * axis;
    frame.R = frame.R * step.X_PJ.rotation();
  } else {
    frame.twist.w_WB += q.rate * axis;
    frame.R = frame.R * turn_at(step, q.cosine, q.sine);
  }
}

/// A product of many rotations, with the rounding errors of its columns' lengths and angles
/// removed.
inline Matrix3 orthonormal(const Matrix3& R) {
  Matrix3 result;
  result.col(0) = R.col(0).normalized();
  result.col(1) = (R.col(1) - result.col(0) * result.col(0).dot(R.col(1))).normalized();
  result.col(2) = result.col(0).cross(result.col(1));
  return result;
}

/// The link at the end: behind the last joint by fixed ones, X_JL.
inline MotionState link_state(const ChainFrame& frame, const RigidPose& X_JL) {
  const Vector3 shift = frame.R * X_JL.translation();
  return {RigidPose::from_trusted(orthonormal(frame.R * X_JL.rotation()), frame.p + shift),
          {frame.twist.v_WB + frame.twist.w_WB.cross(shift), frame.twist.w_WB}};
}

/// What one joint does over a part of a path, and its position at the middle of that part.
struct JointPart {
  JointPath::Bound bound;
  JointInstant middle;
};

/// A part of a path, as its middle and the longest time from there, rounded up.
struct PartMiddle {
  explicit PartMiddle(const TimeInterval& part)
      : time(std::clamp((part.begin + part.end) / 2, part.begin, part.end)),
        // literal: more than the rounding of half the length.
        half(std::max(part.end - time, time - part.begin) * (1 + 0x1p-50)) {}

  Scalar time;
  Scalar half;
};

inline JointPart joint_part(const JointPath& path, std::size_t coordinate, std::size_t piece,
                            const TimeInterval& part, Scalar middle) {
  return {path.bound(coordinate, part), joint_instant(path, coordinate, piece, middle)};
}

/// Bounds of a link's twist over a part of a path, as seen from the link above each of its joints:
/// visit(count, bound) is called with 0, 1, ... joints between. Proof: docs/algorithms/chain.md.
/// @param part_of The JointPart of a coordinate.
/// @param slack   How much farther from a joint the link may be than the path allows.
template <typename PartOf, typename Visit>
void visit_bounds(const LinkMotion& link, const PartMiddle& middle, Scalar noise,
                  const PartOf& part_of, const Visit& visit, Scalar slack = 0) {
  const std::span<const LinkMotion::Turn> turns = link.turns();
  const Scalar up = 1 + kMotionNoise * static_cast<Scalar>(1 + turns.size());
  TwistBound seen;
  Vector3 arm =
      link.X_JL().translation();  // from the joint that was last passed to the link's origin
  Scalar next_rate = 0;           // of the revolute joint that was last passed
  Scalar other_rates = 0;         // of those before it
  visit(0, seen);
  for (std::size_t count = 1; count <= turns.size(); ++count) {
    const LinkMotion::Turn& turn = turns[turns.size() - count];
    const KinematicChain::Step& step = turn.step;
    const JointPart& part = part_of(step.coordinate);
    const JointPath::Bound& rate = part.bound;
    const JointInstant& q = part.middle;
    if (step.type == JointType::Prismatic) {
      seen.linear_acceleration += rate.acceleration;
      seen.linear_speed += rate.speed;
      arm = step.X_PJ.translation() + q.value * step.axis_P + step.X_PJ.rotation() * arm;
    } else {
      arm = step.turn_fixed * arm + q.cosine * (step.turn_cosine * arm) +
            q.sine * (step.turn_sine * arm);
      // How far the link's origin is from the axis, at most.
      const Scalar near_middle =
          norm_of(step.axis_P.cross(arm)) + middle.half * seen.linear_speed + noise;
      const Scalar radius = std::min(turn.reach + slack, near_middle);
      seen.linear_acceleration += times(rate.acceleration, radius) +
                                  rate.speed * rate.speed * radius +
                                  2 * rate.speed * seen.linear_speed;
      seen.linear_speed += rate.speed * radius;
      // The axis of the next joint is at a fixed angle to this one's, those beyond at any.
      const Scalar turning = next_rate * turn.sine_to_next + other_rates;
      seen.angular_acceleration += rate.acceleration + rate.speed * turning;
      seen.angular_speed += rate.speed;
      other_rates += next_rate;
      next_rate = rate.speed;
      arm += step.X_PJ.translation();
    }
    visit(count, TwistBound{up * seen.linear_speed, up * seen.angular_speed,
                            up * seen.linear_acceleration, up * seen.angular_acceleration});
  }
}

}  // namespace dyop::chain_internal
