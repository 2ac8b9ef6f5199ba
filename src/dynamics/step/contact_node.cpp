// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/contact_substep.h"
#include "dynamics/step/spring_rows.h"
#include "dynamics/step/substep_problem.h"

namespace dyop::dynamics_internal {

namespace {

// The part of its impulses with which the next solve of an island that moves begins. How four
// corners share a load, or where two jaws press on what they hold, is not determined: a solve keeps
// what it begins with and adds a little error, so that over many steps the loads drift to a corner.
// Where friction acts depends on it. What is not determined fades, the rest is found again.
constexpr Scalar kKeptLoad = 0.7;

// The impulses of a substep, per contact: those of its move and of its end. The latter warm-start the
// next move.
void keep_impulses(IslandRun& run, const SubstepProblem& node, const std::vector<Vector3>& moving,
                   Scalar tau) {
  const Scalar kept = node.loads_may_drift(tau) ? kKeptLoad : 1;
  for (IslandRun::RunPair& pair : run.pairs()) {
    pair.state->impulses.assign(pair.is_near ? pair.state->points().size() : 0, Vector3::Zero());
  }
  for (std::size_t i = 0; i < node.contacts().size(); ++i) {
    const SubstepContact& entry = node.contacts()[i];
    PairState& state = *run.pairs()[entry.pair].state;
    const Vector3& impulse = node.problem().contacts[i].impulse_W;
    state.impulses[*entry.index] = moving[i] + impulse;
    state.points()[*entry.index].impulse_W = kept * impulse;
  }
}

}  // namespace

// The other half of the kick and the contacts at the end.
void solve_contact_node(IslandRun& run, Scalar tau, bool may_bounce) {
  run.find_contacts();
  SubstepProblem node(run);
  std::vector<Vector3> free_L_W;
  for (std::size_t i = 0; i < run.members().size(); ++i) {
    IslandRun::Member& member = run.members()[i];
    const MotionState state =
        motion_state(member.body->definition.mass_properties, member.state.X_WM, member.state.v_W,
                     node.problem().bodies[i].inverse_inertia_W * member.state.L_W);
    const Wrench wrench = total_wrench(*member.body, run.context().gravity_W, run.now(), state);
    member.state.v_W += tau / 2 * member.body->inverse_mass * wrench.force;
    member.state.L_W += tau / 2 * wrench.torque;
    ContactBody& body = node.problem().bodies[i];
    body.free_v_W = member.state.v_W;
    body.free_w_W = body.inverse_inertia_W * member.state.L_W;
    free_L_W.push_back(member.state.L_W);
  }
  node.take_contacts([&](const IslandRun::RunPair& pair, const ContactPoint& point) {
    if (pair.hit) return false;  // left to the impact law
    return !(may_bounce && bounces(run, pair, normal_velocity(run, pair, point)));
  });
  node.take_joints(tau / 2);
  add_spring_ends(node, tau, free_L_W);
  node.set_supports(0);
  for (std::size_t i = 0; i < node.rows().size(); ++i) {
    const SubstepRow& entry = node.rows()[i];
    if (entry.equation.kind == JointEquation::Kind::Equality) node.set_row_target(i, 0);
    if (entry.equation.kind == JointEquation::Kind::Limit) {
      node.set_row_target(i, std::min(0.0, -entry.equation.value / tau));
    }
  }
  for (std::size_t i = 0; i < node.contacts().size(); ++i) {
    const SubstepContact& entry = node.contacts()[i];
    const Scalar missing = run.pairs()[entry.pair].state->lengths.rest_gap() - entry.point.gap;
    node.set_target(i, std::min(0.0, missing / tau));
  }
  std::vector<Vector3> moving;  // impulses of the move
  for (const PointContact& row : node.problem().contacts) moving.push_back(row.impulse_W);
  node.solve(tau);
  keep_impulses(run, node, moving, tau);
  const std::vector<Vector3> L_W = node.angular_momenta(std::move(free_L_W));
  for (std::size_t i = 0; i < run.members().size(); ++i) {
    run.members()[i].state.v_W = node.problem().bodies[i].v_W;
    run.members()[i].state.L_W = L_W[i];
  }
}

}  // namespace dyop::dynamics_internal
