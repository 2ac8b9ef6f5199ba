// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/export.h"
#include "dyop/motion/rest_motion.h"
#include "toi/deforming/deforming_sides.h"

namespace dyop::internal {

/// A deforming mesh A at a fraction of its interval and a rigid mesh B, where they stand.
struct DYOP_EXPORT StandingPair {
  StandingPair(const DeformingMesh& mesh_a, Scalar s, const TriangleMesh& mesh_b,
               const RigidPose& X_WB);
  StandingPair(const StandingPair&) = delete;
  StandingPair& operator=(const StandingPair&) = delete;

  RestMotion X_WB_motion;
  DeformingSide a;
  RigidSide b;
  Scalar noise;  ///< rounding allowance of a gap
};

}  // namespace dyop::internal
