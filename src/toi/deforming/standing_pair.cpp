// SPDX-License-Identifier: BSD-3-Clause
#include "toi/deforming/standing_pair.h"

#include "core/tolerance.h"

namespace dyop::toi_internal {

StandingPair::StandingPair(const DeformingMesh& mesh_a, Scalar s, const TriangleMesh& mesh_b,
                           const RigidPose& X_WB, const MeshSlabs* slabs_of_a)
    : X_WB_motion(X_WB),
      a(mesh_a, {0, 0}, {s, s}),
      b(mesh_b, X_WB_motion, {0, 0}),
      fraction(s),
      slabs(slabs_of_a),
      noise(kStepNoise * (a.size() + b.size())) {}

std::optional<bool> StandingPair::is_apart_by(Scalar least, const std::function<bool()>& is_over,
                                              BoxPairStack& stack) const {
  DeformingTraversal<RigidSide> traversal(a, b, noise, least, stack);
  traversal.sought_middle = least;
  traversal.start();
  do {
    if (is_over()) return std::nullopt;
  } while (!traversal.run_portion(1));
  return traversal.lower > least;
}

}  // namespace dyop::toi_internal
