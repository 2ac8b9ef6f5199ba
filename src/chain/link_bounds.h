// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "chain/chain_frame.h"
#include "core/tolerance.h"
#include "dyop/chain/link_motion.h"
#include "motion/curve/rotation_rate.h"

namespace dyop::chain_internal {

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
template <typename PartOf, typename Visit>
void visit_bounds(const LinkMotion& link, const PartMiddle& middle, Scalar noise,
                  const PartOf& part_of, const Visit& visit) {
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
      const Scalar radius = std::min(turn.reach, near_middle);
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
