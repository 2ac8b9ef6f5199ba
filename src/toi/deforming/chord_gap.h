// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/export.h"
#include "dyop/core/types.h"
#include "dyop/motion/motion.h"
#include "toi/deforming/standing_pair.h"

namespace dyop::toi_internal {

/// Proves that triangles of a deforming mesh A and a moving rigid mesh B stay apart along one fixed
/// direction, over a whole short interval [0, T], from their places at its two ends.
///
/// Points of A move on straight lines; a point of B at the distance r from its origin leaves its
/// chord by at most T^2 / 8 (sup |dv/dt| + r sup |dw/dt| + r sup |w|^2). So the gap along n of two
/// triangles is, at every time, at least the smaller one of its values at the ends, minus that.
class DYOP_EXPORT ChordGap {
 public:
  /// @param span The part of A's interval during [0, duration].
  ChordGap(const DeformingMesh& a, const DeformingSpan& span, const TriangleMesh& b,
           const Motion& X_WB, Scalar duration);

  /// Lower bound of the gap of two triangles along n, unit, from A to B; rounding included.
  Scalar least(std::int32_t triangle_a, std::int32_t triangle_b, const Vector3& n_W) const;
  /// The same for two boxes, from where they stand at the two ends.
  Scalar least_of_boxes(const StandingPair& begin, const StandingPair& end, std::int32_t box_a,
                        std::int32_t box_b, const Vector3& n_W) const;

 private:
  // How far a point at this distance from the origin leaves its chord.
  Scalar bend(Scalar radius) const;

  const DeformingMesh& a_;
  const DeformingSpan span_;
  const TriangleMesh& b_;
  RigidPose X_WB_begin_;
  RigidPose X_WB_end_;
  // How far a point leaves its chord: a constant plus a multiple of its distance from the origin.
  Scalar bend_;
  Scalar bend_per_length_;
  Scalar noise_;
};

}  // namespace dyop::toi_internal
