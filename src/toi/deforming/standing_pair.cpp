// SPDX-License-Identifier: BSD-3-Clause
#include "toi/deforming/standing_pair.h"

#include "core/tolerance.h"

namespace dyop::internal {

StandingPair::StandingPair(const DeformingMesh& mesh_a, Scalar s, const TriangleMesh& mesh_b,
                           const RigidPose& X_WB)
    : X_WB_motion(X_WB),
      a(mesh_a, {0, 0}, {s, s}),
      b(mesh_b, X_WB_motion, {0, 0}),
      noise(kStepNoise * (a.size() + b.size())) {}

}  // namespace dyop::internal
