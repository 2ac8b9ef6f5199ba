// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "dyop/contact/contact_point.h"
#include "dyop/dynamics/body_id.h"

namespace DYOP_EXPORT dyop {

/// Why two bodies are known to have kept their target distance over a step.
enum class ProofKind {
  ByBound,  ///< their gap at the start exceeds what their motions can close
  ByQuery,  ///< time_of_impact() found no impact
  AtRest,   ///< neither moved
  Excused,  ///< not proven: started nearer than the target, see AdvanceReport::too_near
};

/// A contact at the end of a step, and what it did during the step. Of bodies that overlap it is an
/// estimate, with a negative gap.
struct PairContact {
  ContactPoint point;  ///< at the poses of World::time()
  /// On B (opposite on A), world axes, over the last step. An impulse: force times time.
  Vector3 impulse_W = Vector3::Zero();
};

/// What is known about two near bodies after a step. A pair is near if the boxes of its bodies,
/// swept over the step, overlap.
struct PairRecord {
  BodyId a;
  BodyId b;
  ProofKind proof = ProofKind::AtRest;
  /// Bounds of the distance at World::time(), as narrow as the step needed them. `upper` is
  /// infinite for a pair whose distance was not needed.
  Scalar gap_lower = 0;
  Scalar gap_upper = kInfinity;
  /// Dynamic pivot point, recomputed after each step in which a body of the pair moved: middle of
  /// the internal box of the two bodies' boxes while they are farther apart than their contacts
  /// reach, then middle of the nearest contact's witness segment. The pair's next distance and
  /// impact queries begin there (docs/algorithms/stepping.md).
  Vector3 pivot_W = Vector3::Zero();
  Vector3 nhat_AB_W = Vector3::UnitX();  ///< from A to B
  std::int64_t advancement_steps = 0;    ///< node pairs of time_of_impact() in the last step
  std::vector<PairContact> contacts;
  Scalar residual = 0;  ///< of the island's last contact solve, length per time
};

}  // namespace dyop
