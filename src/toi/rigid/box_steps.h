// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/instruction_set.h"
#include "hierarchy/box_gaps.h"

namespace dyop::toi_internal {

/// Over a trial so many times longer than the root of its bound, the remainder of third order decides:
/// the next trial is between them in order of magnitude.
inline constexpr double kMuchTooLong = 16;

/// A pair of boxes whose gap exceeds this fraction of its size is examined again, at its new time,
/// before it is split; without this the number of pairs of distant trees explodes. Speed only.
inline constexpr double kReadvanceRatio = 0.3;

/// How two bodies move from one instant t on, as seen from the shape S that a group of boxes
/// belongs to; O is the other shape. All vectors in the frame of S at time t. Plain numbers, for
/// the wide kernels; PairInstant is the same in world.
struct FacingMotion {
  double origin[3];         ///< from the origin of S to that of O
  double velocity[3];       ///< v_O - v_S of the origins
  double turning[3];        ///< angular velocity of S
  double other_turning[3];  ///< angular velocity of O
  double turning_sq;        ///< squared norms of the two
  double other_turning_sq;
  double largest_turning;      ///< rounded up
  double origin_distance;      ///< between the origins of the two bodies
  double origin_opening;       ///< its rate
  double remaining;            ///< time from t to the end of the query
  double horizon;              ///< time for which the accelerations hold; <= remaining
  double linear_acceleration;  ///< sum over both bodies
  double angular_acceleration;
  double other_angular_acceleration;
  double linear_speed;  ///< sum over both bodies, over `remaining`
  double angular_speed;
  double other_angular_speed;
  double floor;    ///< the distance to keep
  double noise;    ///< rounding allowance of a gap, length
  bool is_steady;  ///< no turning and no acceleration: gaps are linear in time
};

/// The other box, with its position and motion.
struct FacingPiece {
  FacingBox box;
  double from_origin[3];  ///< its center from the origin of O, in the frame of S
  double radius;          ///< largest distance of one of its points from the origin of O
  double half_diagonal;
};

/// For each box of the group: how long it is proven to stay more than `floor` from the other,
/// rounded down, where infinity means to the end of the query; and whether it is far away for its
/// size.
struct BoxSteps {
  double time[kGroupWidth];
  unsigned is_far;  ///< one bit per box
};

/// The coupled second-order bound of docs/algorithms/time_of_impact.md, as safe_step(), for `count`
/// boxes of a group from column `first` on; results are in the same columns.
using BoxStepsKernel = void (*)(const GroupRows& rows, int first, int count,
                                const FacingPiece& other, const FacingMotion& motion,
                                BoxSteps* steps);

struct BoxStepsKernels {
  BoxStepsKernel group;  ///< first = 0
  BoxStepsKernel one;    ///< count = 1
};

/// The kernels for an instruction set, which this processor must support.
BoxStepsKernels box_steps_kernels(InstructionSet set);

}  // namespace dyop::toi_internal
