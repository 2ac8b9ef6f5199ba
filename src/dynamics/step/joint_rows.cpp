// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/joint_rows.h"

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"

namespace dyop::dynamics_internal {
namespace {

// A prediction that still changes by more than this part of what a substep can close is a guess.
constexpr Scalar kGuessedPart = 0.1;
// Substeps of this part of a step are not shortened for a joint.
constexpr Scalar kLeastJointedSubstep = 1.0 / 64;  // literal: of a turn a step, a tenth of a radian

// The largest error that a joint closes in one substep.
Scalar recovery_of_substep(const SubstepProblem& substep, const JointState& joint) {
  const BodyRecord& a = substep.run().context().body(joint.definition.a.slot);
  const BodyRecord& b = substep.run().context().body(joint.definition.b.slot);
  return kSeparationRadiusFraction * std::min(a.radius, b.radius);
}

}  // namespace

void set_joint_targets(SubstepProblem& substep, Scalar tau) {
  for (std::size_t i = 0; i < substep.rows().size(); ++i) {
    const SubstepRow& entry = substep.rows()[i];
    if (entry.equation.kind == JointEquation::Kind::Motor) continue;
    const Scalar most = recovery_of_substep(substep, *entry.joint) / tau;
    const bool is_limit = entry.equation.kind == JointEquation::Kind::Limit;
    // What the turn of the bodies takes from the joint is not bounded: that would tear it open.
    const Scalar recovery =
        std::clamp(-entry.equation.value / tau, is_limit ? -kInfinity : -most, most);
    substep.set_row_target(i, recovery - entry.error / tau);
  }
}

bool update_joint_errors(SubstepProblem& substep, Scalar tau, const EndPose& end_pose) {
  bool has_changed = false;
  std::vector<JointEquation> ends;
  const JointState* of = nullptr;
  for (std::size_t i = 0; i < substep.rows().size(); ++i) {
    SubstepRow& entry = substep.rows()[i];
    if (entry.equation.kind == JointEquation::Kind::Motor) continue;
    if (entry.joint != of) {
      of = entry.joint;
      const IslandRun& run = substep.run();
      const BodyRecord& a = run.context().body(of->definition.a.slot);
      const BodyRecord& b = run.context().body(of->definition.b.slot);
      ends = joint_equations(of->definition, a, end_pose(run.member_at(a.id), a), b,
                             end_pose(run.member_at(b.id), b), std::min(a.radius, b.radius));
    }
    const Scalar linear = entry.equation.value + tau * substep.row_velocity(i);
    const Scalar error = ends[entry.index].value - linear;
    has_changed =
        has_changed || std::abs(error - entry.error) > kErrorChange * substep.rest_offset();
    entry.change = std::abs(error - entry.error);
    entry.error = error;
  }
  return has_changed;
}

bool joints_are_guessed(const SubstepProblem& substep, Scalar tau) {
  if (!(tau > kLeastJointedSubstep * substep.run().context().h)) return false;
  return std::any_of(substep.rows().begin(), substep.rows().end(), [&](const SubstepRow& entry) {
    return entry.change > kGuessedPart * recovery_of_substep(substep, *entry.joint);
  });
}

bool release_joint_recovery(SubstepProblem& substep, Scalar tau) {
  bool has_recovery = false;
  for (std::size_t i = 0; i < substep.rows().size(); ++i) {
    const SubstepRow& entry = substep.rows()[i];
    if (entry.equation.kind == JointEquation::Kind::Motor) continue;
    const Scalar wanted = substep.problem().rows[i].target;
    Scalar physical = -entry.error / tau;
    if (entry.equation.kind == JointEquation::Kind::Limit) {
      physical = std::min(wanted, std::max(0.0, physical));
    }
    has_recovery = has_recovery || physical != wanted;
    substep.set_row_target(i, physical);
  }
  return has_recovery;
}

}  // namespace dyop::dynamics_internal
