// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/motion/rest_motion.h"
#include "toi/deforming/deforming_sides.h"

namespace dyop::internal {

/// A deforming mesh A at a fraction of its interval and a rigid mesh B, where they stand.
struct StandingPair {
  StandingPair(const DeformingMesh& mesh_a, Scalar s, const TriangleMesh& mesh_b,
               const RigidPose& X_WB)
      : X_WB_motion(X_WB),
        a(mesh_a, {0, 0}, {s, s}),
        b(mesh_b, X_WB_motion, {0, 0}),
        noise(kStepNoise * (a.size() + b.size())) {}
  StandingPair(const StandingPair&) = delete;
  StandingPair& operator=(const StandingPair&) = delete;

  RestMotion X_WB_motion;
  DeformingSide a;
  RigidSide b;
  Scalar noise;  ///< rounding allowance of a gap
};

}  // namespace dyop::internal
