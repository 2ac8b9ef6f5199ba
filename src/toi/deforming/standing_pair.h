// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>

#include "dyop/core/export.h"
#include "dyop/motion/rest_motion.h"
#include "toi/deforming/deforming_sides.h"
#include "toi/deforming/deforming_traversal.h"

namespace dyop::internal {

/// A deforming mesh A at a fraction of its interval and a rigid mesh B, where they stand.
struct DYOP_EXPORT StandingPair {
  StandingPair(const DeformingMesh& mesh_a, Scalar s, const TriangleMesh& mesh_b,
               const RigidPose& X_WB);
  StandingPair(const StandingPair&) = delete;
  StandingPair& operator=(const StandingPair&) = delete;

  /// Lower bounds of the distance of two boxes, or of two leaves' triangles: their gap along n,
  /// unit, from A to B.
  Scalar box_gap(std::int32_t box_a, std::int32_t box_b, const Vector3& n_W) const {
    return -b.box_reach(box_b, -n_W) - a.box_support(box_a, n_W).at(0, 0) - noise;
  }
  Scalar triangle_gap(std::int32_t leaf_a, std::int32_t leaf_b, const Vector3& n_W) const {
    return -b.triangle_reach(leaf_b, -n_W) - largest_along(a.triangle_W(leaf_a), n_W) - noise;
  }

  /// Whether all triangles are farther apart than this; nothing if is_over(), which is asked before
  /// every pair of boxes, says so first.
  std::optional<bool> is_apart_by(Scalar least, const std::function<bool()>& is_over,
                                  BoxPairStack& stack) const;

  RestMotion X_WB_motion;
  DeformingSide a;
  RigidSide b;
  Scalar noise;  ///< rounding allowance of a gap
};

}  // namespace dyop::internal
