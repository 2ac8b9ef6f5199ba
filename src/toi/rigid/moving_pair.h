// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

#include "distance/piece_distance.h"
#include "dyop/motion/motion.h"
#include "geometry/shape_tree.h"
#include "motion/guarded_state.h"
#include "toi/rigid/box_steps.h"
#include "toi/rigid/motion_bounds.h"
#include "toi/rigid/safe_step.h"

namespace dyop::toi_internal {

/// Whether a shape is a ball about the origin of its frame: turns do not move it.
inline bool is_centred_ball(const ConvexShape* shape) {
  if (!shape) return false;
  const SimpleCore& core = shape->simple_core();
  return core.kind == CoreKind::Point && core.is_centred;
}

/// Names of a query's motions in messages.
inline constexpr const char* kMotionOfA = "time_of_impact: the motion of A";
inline constexpr const char* kMotionOfB = "time_of_impact: the motion of B";

/// One of the two bodies of a query: its shape and its motion.
struct MovingShape {
  /// @param extent  As for ShapeTree.
  /// @param lookups Few: two convex shapes, one pair of leaves, whose boxes nobody asks for.
  MovingShape(const Shape& the_shape, const Motion& the_motion, const TimeInterval& interval,
              Scalar extent, BoundLookups lookups, const char* the_name)
      : name(the_name),
        shape(the_shape),
        tree(the_shape, extent, box_for(lookups)),
        is_ball(is_centred_ball(tree.convex())),
        radius((tree.convex() ? *tree.convex() : the_shape).bounding_radius()),
        motion(the_motion),
        is_trusted(the_motion.is_trusted()),
        bounds(the_motion, interval, lookups) {}

  const char* name;  ///< name of its motion in messages
  const Shape& shape;
  ShapeTree tree;
  const bool is_ball;
  const Scalar radius;
  const Motion& motion;
  const bool is_trusted;  ///< the motion
  MotionBounds bounds;

 private:
  static ShapeTree::ConvexBox box_for(BoundLookups lookups) {
    return lookups == BoundLookups::Few ? ShapeTree::ConvexBox::None : ShapeTree::ConvexBox::Fitted;
  }
};

/// Largest distance of a point of a box from the origin of its frame, rounded up.
inline Scalar node_radius(const OrientedBox& box) {
  // literal: more than axes orthonormal to single precision can stretch.
  return (box.center.norm() + box.half_extents.norm()) * (1 + 0x1p-20);
}

/// The two bodies of a query at one time of an interval, in the forms that the bounds need. A ball
/// about its origin counts as not turning.
class MovingPair {
 public:
  /// `interval` must be valid. Throws InvalidArgument for a motion that is unsound at its start.
  MovingPair(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
             const TimeInterval& interval, Scalar floor);

  /// @throws InvalidArgument for a pose or twist that guarded_state() refuses, and for a jump.
  void set_time(Scalar t);
  Scalar time() const { return time_; }

  const MovingShape& a() const { return a_; }
  const MovingShape& b() const { return b_; }
  const RigidPose& X_AB() const { return X_AB_; }
  const PairInstant& now() const { return now_; }
  /// Bound on the speed at which a gap can shrink, over the whole query.
  Scalar largest_speed() const { return largest_speed_; }

  /// Rounding allowance of a gap over the whole query, length; see
  /// docs/algorithms/time_of_impact.md.
  Scalar noise() const { return now_.noise; }

  /// Whether no twist jumps in the interval.
  bool is_smooth() const { return is_smooth_; }
  /// How both bodies may move from this time on: outlook 0 holds until a twist jumps, the others
  /// until later, but allow for more (MotionStretch).
  const PairInstant& outlook(std::size_t k) const {
    return k == 0 ? now_ : further_[k - 1].instant;
  }
  /// An outlook that holds longer than outlook k and longer than `step`; 0 if none is known.
  std::size_t outlook_beyond(std::size_t k, Scalar step);
  /// An outlook seen from A, or from B.
  const FacingMotion& facing_motion(bool from_a, std::size_t k = 0);

  /// The longest of the safe steps in the outlooks. `step_in(outlook)` returns one; a step that
  /// lasts as long as its outlook may go on in the next.
  template <typename StepIn>
  Scalar longest_step(const StepIn& step_in) {
    Scalar longest = step_in(now_);
    for (std::size_t k = 0; longest >= outlook(k).horizon && longest < now_.remaining;) {
      k = outlook_beyond(k, longest);
      if (k == 0) break;
      longest = std::max(longest, step_in(outlook(k)));
    }
    return longest;
  }

  /// A box of B seen from A, or of A seen from B.
  FacingPiece facing_piece(bool from_a, std::int32_t box) const;

  /// -d/dt of the gap between the witness points, along the normal.
  Scalar closing_speed(const PieceDistance& piece) const;

  /// Closing by more than rounding.
  bool is_closing(const PieceDistance& piece) const;

  /// How long two leaves, whose distance now is `piece`, stay more than `floor` apart.
  Scalar leaf_step(const PieceDistance& piece, std::int32_t leaf_a, std::int32_t leaf_b,
                   Scalar floor);

 private:
  struct Facing {
    FacingMotion motion;
    bool is_current = false;
  };
  struct Outlook {
    PairInstant instant;
    Scalar after = 0;  // ends after this time
    Scalar end = 0;
    Facing facing_a = {};
    Facing facing_b = {};
  };

  /// The normal of a pair of leaves, turning with the features to which it is perpendicular.
  TurningNormal normal_with_features(const PieceDistance& piece, const LeafPiece& piece_a,
                                     const LeafPiece& piece_b) const;
  Scalar rounding_allowance() const;
  void set_horizon();
  bool add_outlook(Scalar after);
  void bound_accelerations(PairInstant& outlook, const TwistBound& a, const TwistBound& b) const;
  static bool is_steady(const PairInstant& outlook);
  void fill(FacingMotion& facing, const PairInstant& outlook, bool from_a) const;

  const TimeInterval interval_;
  MovingShape a_;
  MovingShape b_;
  const Scalar floor_;
  bool is_smooth_ = false;  // no twist jumps in the interval
  Scalar time_ = 0;
  Scalar largest_speed_ = 0;
  PairInstant now_;
  RigidPose X_AB_;
  Scalar horizon_end_ = 0;  // of now_
  Facing facing_a_;
  Facing facing_b_;
  std::vector<Outlook> further_;  // of which so many belong to this time
  std::size_t further_count_ = 0;
};

}  // namespace dyop::toi_internal
