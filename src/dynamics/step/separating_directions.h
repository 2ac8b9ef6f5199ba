// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "distance/distance_traversal.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/shape.h"

namespace dyop::dynamics_internal {

/// Relative motion over a span tau, seen from a plane fixed to one shape S. A point of the other
/// one, O, that starts at most l from S's centre of mass leaves the chord between its places by at
/// most
///     tau^2 / 8 (w_O^2 r_O + 2 w_S V + w_S^2 (l + tau V)),  V = |v_O - v_S| + w_O r_O,
/// = `bend` + `bend_slope` l. So it is never nearer to the plane by more than that than at an end.
struct ChordMotion {
  /// What is known of the planes of one shape.
  struct Side {
    Vector3 center = Vector3::Zero();  ///< of mass, in the shape's frame
    Scalar bend = 0;                   ///< length
    Scalar bend_slope = 0;
  };
  RigidPose X_AB_begin;
  RigidPose X_AB_middle;  ///< only where directions are sought
  RigidPose X_AB_end;
  Side a;
  Side b;
};

/// For pairs of pieces that slide or roll past each other, a direction that parts them, from step
/// to step: a unit normal, fixed to the one of the two shapes that has a face there. Support values
/// tell how far the pieces are apart along it at both ends of a step; in between that changes
/// like a line, up to the bend of the motion. So a direction, once found, proves most steps of its
/// pair without a distance.
class SeparatingDirections {
 public:
  /// Leaves those pairs of leaves that are not proven more than `least` apart at all times of a
  /// motion.
  /// @param noise Allowance for rounding in a gap; included in `least`.
  void keep_unproven(const Shape& a, const Shape& b, const ChordMotion& motion, Scalar least,
                     Scalar noise, BoxPairStack& pairs);

 private:
  struct Direction {
    std::int32_t a = 0;  // leaves
    std::int32_t b = 0;
    bool is_of_b = false;              // fixed to B
    Vector3 normal = Vector3::Zero();  // unit, from A to B, in the frame of its shape

    friend bool operator<(const Direction& x, const Direction& y) {
      return x.a != y.a ? x.a < y.a : x.b < y.b;
    }
  };

  std::vector<Direction> directions_;  // of the pairs of the last call, sorted
  std::vector<Direction> last_;        // memory
};

}  // namespace dyop::dynamics_internal
