// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/joint_rows.h"

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"

namespace dyop::internal {

void set_joint_targets(LegProblem& leg, Scalar tau) {
  for (std::size_t i = 0; i < leg.rows().size(); ++i) {
    const LegRow& entry = leg.rows()[i];
    if (entry.equation.kind == JointEquation::Kind::Motor) continue;
    const BodyRecord& a = leg.run().context().body(entry.joint->definition.a.slot);
    const BodyRecord& b = leg.run().context().body(entry.joint->definition.b.slot);
    const Scalar most = kSeparationRadiusFraction * std::min(a.radius, b.radius) / tau;
    const Scalar wanted = -(entry.equation.value + entry.error) / tau;
    const bool is_limit = entry.equation.kind == JointEquation::Kind::Limit;
    leg.set_row_target(i, std::clamp(wanted, is_limit ? -kInfinity : -most, most));
  }
}

bool update_joint_errors(LegProblem& leg, Scalar tau, const EndPose& end_pose) {
  bool has_changed = false;
  std::vector<JointEquation> ends;
  const JointState* of = nullptr;
  for (std::size_t i = 0; i < leg.rows().size(); ++i) {
    LegRow& entry = leg.rows()[i];
    if (entry.equation.kind == JointEquation::Kind::Motor) continue;
    if (entry.joint != of) {
      of = entry.joint;
      const IslandRun& run = leg.run();
      const BodyRecord& a = run.context().body(of->definition.a.slot);
      const BodyRecord& b = run.context().body(of->definition.b.slot);
      ends = joint_equations(of->definition, a, end_pose(run.member_at(a.id), a), b,
                             end_pose(run.member_at(b.id), b), std::min(a.radius, b.radius));
    }
    const Scalar linear = entry.equation.value + tau * leg.row_velocity(i);
    const Scalar error = ends[entry.index].value - linear;
    has_changed = has_changed || std::abs(error - entry.error) > kErrorChange * leg.standoff();
    entry.error = error;
  }
  return has_changed;
}

bool release_joint_recovery(LegProblem& leg, Scalar tau) {
  bool has_recovery = false;
  for (std::size_t i = 0; i < leg.rows().size(); ++i) {
    const LegRow& entry = leg.rows()[i];
    if (entry.equation.kind == JointEquation::Kind::Motor) continue;
    const Scalar wanted = leg.problem().rows[i].target;
    Scalar physical = -entry.error / tau;
    if (entry.equation.kind == JointEquation::Kind::Limit) {
      physical = std::min(wanted, std::max(0.0, physical));
    }
    has_recovery = has_recovery || physical != wanted;
    leg.set_row_target(i, physical);
  }
  return has_recovery;
}

}  // namespace dyop::internal
