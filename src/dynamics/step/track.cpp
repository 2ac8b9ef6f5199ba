// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/track.h"

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"
#include "dyop/motion/composed_motion.h"

namespace dyop::dynamics_internal {
namespace {

// Largest speed of any point of B relative to A.
Scalar speed_seen_from(const BodyMove& a, const BodyMove& b, Scalar tau) {
  const Vector3 D = b.center - a.center;
  const Vector3 v = b.v_W - a.v_W;
  return (v - a.w_W.cross(D)).norm() + tau * a.w_W.norm() * v.norm() +
         (b.w_W - a.w_W).norm() * b.body->radius;
}

Scalar speed_bound(const BodyMove& move, const TimeInterval& interval) {
  if (move.is_rest) return 0;
  if (move.most_speed < kInfinity && move.bounded.begin == interval.begin &&
      move.bounded.end == interval.end) {
    return move.most_speed;
  }
  const TwistBound bound = move.motion->twist_bound(interval);
  return bound.linear_speed + bound.angular_speed * move.body->radius_B;
}

// How the planes fixed to `own` move.
ChordMotion::Side chord_side(const BodyMove& own, const BodyMove& other, Scalar tau) {
  const Scalar w_own = own.w_W.norm();
  const Scalar w_other = other.w_W.norm();
  const Scalar passing = (other.v_W - own.v_W).norm() + w_other * other.body->radius;
  const Scalar eighth = (1 + kMotionNoise) * tau * tau / 8;
  ChordMotion::Side side;
  side.center = own.body->definition.mass_properties.p_BoBcm;
  side.bend_slope = eighth * w_own * w_own;
  side.bend = eighth * (w_other * w_other * other.body->radius + 2 * w_own * passing) +
              side.bend_slope * tau * passing;
  return side;
}

}  // namespace

void BodyMove::bound_speed(const TimeInterval& interval) {
  if (is_rest || is_twist) return;
  most_speed = kInfinity;
  most_speed = speed_bound(*this, interval);
  bounded = interval;
}

bool Track::is_rest() const {
  return std::all_of(pieces.begin(), pieces.end(),
                     [](const Piece& piece) { return piece.is_rest; });
}

std::shared_ptr<const Motion> Track::joined() const {
  if (pieces.size() == 1) return pieces.front().motion;
  std::vector<SequenceMotion::Part> parts;
  parts.reserve(pieces.size());
  for (const Piece& piece : pieces) parts.push_back({piece.interval, piece.motion});
  return std::make_shared<SequenceMotion>(std::move(parts));
}

BodyMove twist_move(const BodyRecord& body, const CentralState& state, Scalar t, const Vector3& v_W,
                    const Vector3& w_W) {
  BodyMove move;
  move.body = &body;
  move.motion =
      about_center(body, std::make_shared<ConstantTwistMotion>(state.X_WM, Twist{v_W, w_W}, t));
  move.is_twist = true;
  move.center = state.X_WM.translation();
  move.v_W = v_W;
  move.w_W = w_W;
  return move;
}

Scalar most_travel(const BodyMove& move, Scalar tau) {
  if (move.is_rest) return 0;
  if (!move.is_twist) return kInfinity;
  return (1 + kMotionNoise) * tau * (move.v_W.norm() + move.w_W.norm() * move.body->radius);
}

BodyMove rest_move(const BodyRecord& body, std::shared_ptr<const Motion> rest) {
  BodyMove move;
  move.body = &body;
  move.motion = std::move(rest);
  move.is_rest = true;
  move.is_twist = true;
  move.center = body.state.X_WM.translation();
  return move;
}

BodyMove motion_move(const BodyRecord& body, std::shared_ptr<const Motion> motion, Scalar t) {
  BodyMove move;
  move.body = &body;
  move.center = central_pose(body, motion->pose(t)).translation();
  move.motion = std::move(motion);
  return move;
}

RigidPose central_pose(const BodyRecord& body, const RigidPose& X_WB) {
  return RigidPose::from_trusted(X_WB.rotation(), X_WB * body.definition.mass_properties.p_BoBcm);
}

Scalar closing_bound(const BodyMove& a, const BodyMove& b, const TimeInterval& interval) {
  const Scalar tau = interval.length();
  const Scalar slack = 1 + kMotionNoise;
  if (a.is_twist && b.is_twist) {
    return slack * tau * std::min(speed_seen_from(a, b, tau), speed_seen_from(b, a, tau));
  }
  return slack * tau * (speed_bound(a, interval) + speed_bound(b, interval));
}

// In the frame of A, with P fixed there and D = c_B - c_A, the point of B at P + y moves at
// v_B - v_A + (w_B - w_A) x (P - c_A + y) - w_B x D. At y = 0 this changes at most at
// |w_B - w_A| |w_A| |P - c_A| + |w_B| |v_B - v_A|, so that with W = |w_B - w_A| the point that
// begins at P moves at most at u + W |y|: no farther than u (exp(W tau) - 1) / W. B turns by W tau
// about it.
NearBound approach_bound(const BodyMove& a, const BodyMove& b, const TimeInterval& interval,
                         const Vector3& pivot_W) {
  if (!a.is_twist || !b.is_twist) return {closing_bound(a, b, interval)};
  const Scalar tau = interval.length();
  const Vector3 v = b.v_W - a.v_W;
  const Vector3 w = b.w_W - a.w_W;
  const Vector3 lever = pivot_W - a.center;
  const Scalar at_begin = (v + w.cross(lever) - b.w_W.cross(b.center - a.center)).norm();
  const Scalar change = w.norm() * a.w_W.norm() * lever.norm() + b.w_W.norm() * v.norm();
  const Scalar angle = tau * w.norm();
  const Scalar growth = angle > 0 ? std::expm1(angle) / angle : Scalar{1};
  const Scalar slack = 1 + kMotionNoise;
  return {slack * tau * growth * (at_begin + tau * change), slack * angle};
}

std::optional<ChordMotion> chord_motion(const BodyMove& a, const BodyMove& b,
                                        const TimeInterval& interval) {
  if (!a.is_twist || !b.is_twist) return std::nullopt;
  const auto X_AB = [&](Scalar t) { return a.motion->pose(t).inverse() * b.motion->pose(t); };
  const Scalar tau = interval.length();
  return ChordMotion{X_AB(interval.begin), X_AB(interval.begin + tau / 2), X_AB(interval.end),
                     chord_side(a, b, tau), chord_side(b, a, tau)};
}

}  // namespace dyop::dynamics_internal
