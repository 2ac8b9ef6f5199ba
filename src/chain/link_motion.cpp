// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/chain/link_motion.h"

#include <algorithm>
#include <cmath>

#include "chain/chain_frame.h"
#include "chain/joint_chords.h"
#include "dyop/core/error.h"

namespace dyop {
LinkMotion::LinkMotion(std::shared_ptr<const KinematicChain> chain,
                       std::shared_ptr<const JointPath> path, std::size_t link)
    : chain_(std::move(chain)), path_(std::move(path)), link_(link) {
  DYOP_REQUIRE(chain_ && path_, "a link's motion needs a chain and a path, one is null");
  X_WF_ = chain_->X_WR();
  collect();
}

LinkMotion::LinkMotion(std::shared_ptr<const KinematicChain> chain,
                       std::shared_ptr<const JointPath> path, std::size_t link, std::size_t base)
    : chain_(std::move(chain)), path_(std::move(path)), link_(link), base_(base) {
  DYOP_REQUIRE(chain_ && path_, "a link's motion needs a chain and a path, one is null");
  collect();
}

void LinkMotion::collect() {
  const std::size_t count = chain_->links().size();
  DYOP_REQUIRE(link_ < count && base_.value_or(0) < count, "the chain has ", count,
               " links, not link ", link_ < count ? *base_ : link_);
  DYOP_REQUIRE(path_->coordinate_count() == chain_->coordinate_count(), "the path has ",
               path_->coordinate_count(), " coordinates, the chain ", chain_->coordinate_count());
  std::vector<const KinematicChain::Step*> steps;
  steps.reserve(chain_->depth(link_));
  for (std::size_t up = link_; base_ ? up != *base_ : bool(chain_->step(up));
       up = chain_->step(up)->parent) {
    DYOP_REQUIRE(chain_->step(up), "link '", chain_->links()[*base_].name,
                 "' is not on the path from the root to link '", chain_->links()[link_].name, "'");
    steps.push_back(&*chain_->step(up));
  }
  turns_.reserve(steps.size());
  std::optional<RigidPose> before;  // of the fixed joints since the last moving one
  for (auto step = steps.rbegin(); step != steps.rend(); ++step) {
    if ((*step)->type == JointType::Fixed) {
      before = before ? *before * (*step)->X_PJ : (*step)->X_PJ;
      continue;
    }
    KinematicChain::Step& turn = turns_.emplace_back(Turn{**step}).step;
    if (!before) continue;
    turn.axis_P = before->rotation() * turn.axis_P;
    turn.X_PJ = *before * turn.X_PJ;
    chain_internal::set_turn(turn);
    before.reset();
  }
  X_JL_ = before.value_or(RigidPose());
  measure();
}

// The scale of rounding, for motions composed from the base to the link; how far the link reaches
// from each joint; and the angles between neighbouring axes, which only prismatic joints separate
// and which stay the same.
void LinkMotion::measure() {
  scale_ = {X_WF_.translation().stableNorm(), 1};
  for (const Turn& turn : turns_) {
    const Scalar reach = path_->largest_value(turn.step.coordinate);
    const bool is_prismatic = turn.step.type == JointType::Prismatic;
    const Scalar length = turn.step.X_PJ.translation().stableNorm() + (is_prismatic ? reach : 0);
    scale_.length += (scale_.angle + 1) * length;
    scale_.angle += is_prismatic ? 1 : 1 + 2 * reach;
  }
  Scalar reach = X_JL_.translation().stableNorm();
  scale_.length += (scale_.angle + 1) * reach;
  for (auto turn = turns_.rbegin(); turn != turns_.rend(); ++turn) {
    const KinematicChain::Step& step = turn->step;
    if (step.type == JointType::Prismatic) reach += path_->largest_value(step.coordinate);
    turn->reach = motion_internal::round_up(reach);
    reach += step.X_PJ.translation().stableNorm();
  }

  Matrix3 R = Matrix3::Identity();  // at zero coordinates
  Turn* last = nullptr;
  Vector3 last_axis = Vector3::Zero();
  for (Turn& turn : turns_) {
    if (turn.step.type == JointType::Revolute) {
      const Vector3 axis = R * turn.step.axis_P;
      if (last) {
        const Scalar sine = motion_internal::round_up(last_axis.cross(axis).norm()) + kMotionNoise;
        last->sine_to_next = std::min(1.0, sine);
      }
      last = &turn;
      last_axis = axis;
    }
    R = R * turn.step.X_PJ.rotation();
  }
}

MotionState LinkMotion::state(Scalar t) const {
  const std::size_t piece = path_->piece_at(t);
  chain_internal::ChainFrame frame{X_WF_.rotation(), X_WF_.translation(), {}};
  for (const Turn& turn : turns_) {
    const std::size_t coordinate = turn.step.coordinate;
    chain_internal::advance(frame, turn.step,
                            chain_internal::joint_instant(*path_, coordinate, piece, t));
  }
  return chain_internal::link_state(frame, X_JL_);
}

RigidPose LinkMotion::pose(Scalar t) const {
  return LinkMotion::state(t).X_WB;
}

Twist LinkMotion::twist(Scalar t) const {
  return LinkMotion::state(t).twist;
}

TwistBound LinkMotion::twist_bound(const TimeInterval& interval) const {
  const chain_internal::PartMiddle middle(interval);
  const std::size_t piece = path_->piece_at(middle.time);
  TwistBound bound;
  chain_internal::visit_bounds(
      *this, middle, kPoseNoise * scale_.length,
      [&](std::size_t coordinate) {
        return chain_internal::joint_part(*path_, coordinate, piece, interval, middle.time);
      },
      [&bound](std::size_t, const TwistBound& seen) { bound = seen; });
  return bound;
}

PoseScale LinkMotion::pose_scale(const TimeInterval&) const {
  return scale_;
}

Scalar LinkMotion::smooth_until(Scalar t) const {
  const std::span<const Scalar> times = path_->times();
  const auto next = std::upper_bound(times.begin(), times.end(), t);
  return next == times.end() ? kInfinity : *next;
}

// The link on a path with constant rates. Taking over one coordinate after another from it, each
// moves the link by no more than its difference times the link's reach.
std::optional<MotionStretch> LinkMotion::stretch(Scalar t, Scalar after) const {
  const chain_internal::JointChords* const chords = path_->chords();
  const std::size_t piece = path_->piece_at(t);
  const auto window = chords ? chords->window(piece, after) : std::nullopt;
  if (!window) return std::nullopt;
  MotionStretch stretch;
  stretch.end = window->end;
  Scalar slack = 0;  // how much farther prismatic joints may go on that path
  for (const Turn& turn : turns_) {
    if (turn.step.type == JointType::Prismatic) slack += window->strays[turn.step.coordinate];
  }
  chain_internal::ChainFrame frame{X_WF_.rotation(), X_WF_.translation(), {}};
  for (const Turn& turn : turns_) {
    const std::size_t coordinate = turn.step.coordinate;
    auto instant = chain_internal::joint_instant(*path_, coordinate, piece, t);
    instant.rate = window->rates[coordinate];
    chain_internal::advance(frame, turn.step, instant);
    const bool is_prismatic = turn.step.type == JointType::Prismatic;
    const Scalar strays = window->strays[coordinate];
    stretch.linear_deviation += is_prismatic ? strays : strays * (turn.reach + slack);
    stretch.angular_deviation += is_prismatic ? 0 : strays;
  }
  stretch.twist = chain_internal::link_state(frame, X_JL_).twist;
  const chain_internal::PartMiddle middle({t, window->end});
  const auto steady_part = [&](std::size_t coordinate) {
    const Scalar rate = window->rates[coordinate];
    const Scalar value = path_->sample(coordinate, piece, t).value + (middle.time - t) * rate;
    return chain_internal::JointPart{{motion_internal::round_up(std::abs(rate)), 0},
                                     {value, rate, std::cos(value), std::sin(value)}};
  };
  chain_internal::visit_bounds(
      *this, middle, kPoseNoise * scale_.length, steady_part,
      [&stretch](std::size_t, const TwistBound& seen) {
        stretch.linear_acceleration = seen.linear_acceleration;
        stretch.angular_acceleration = seen.angular_acceleration;
      },
      slack);
  stretch.linear_deviation = motion_internal::round_up(stretch.linear_deviation);
  stretch.angular_deviation = std::min(2.0, motion_internal::round_up(stretch.angular_deviation));
  return stretch;
}

}  // namespace dyop
