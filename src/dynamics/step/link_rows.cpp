// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/link_rows.h"

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"

namespace dyop::dynamics_internal {

// Joints.

namespace {

// If the predicted joint error still changes by more than this fraction of the closable error,
// reject the substep.
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

bool release_joint_recovery(SubstepProblem& substep, Scalar tau, bool bends) {
  bool has_recovery = false;
  for (std::size_t i = 0; i < substep.rows().size(); ++i) {
    const SubstepRow& entry = substep.rows()[i];
    if (entry.equation.kind == JointEquation::Kind::Motor) continue;
    const Scalar wanted = substep.problem().rows[i].target;
    Scalar physical = bends ? -entry.error / tau : 0;
    if (entry.equation.kind == JointEquation::Kind::Limit) {
      physical = std::min(wanted, std::max(0.0, physical));
    }
    has_recovery = has_recovery || physical != wanted;
    substep.set_row_target(i, physical);
  }
  return has_recovery;
}

// Springs.

namespace {

// A solve is repeated if the length or direction of a spring has changed by more than this relative
// to the rest offset. Larger: springs lose energy.
constexpr Scalar kSpringErrorChange = 4e-4;  // literal: a fiftieth of what gaps need

// Weight of a spring's row across the spring where it has no stiffness, relative to that along it.
constexpr Scalar kSpringLeastShare = 1e-9;  // literal: nothing, but the row stays solvable

// Columns x, y, z with x along `direction`; those of the world if it is zero.
Matrix3 axes_along(const Vector3& direction) {
  const Scalar length = direction.norm();
  if (!(length > 0)) return Matrix3::Identity();
  const Vector3 x = direction / length;
  Matrix3 axes;
  axes.col(0) = x;
  axes.col(1) = x.unitOrthogonal();
  axes.col(2) = x.cross(axes.col(1));
  return axes;
}

struct Law {
  Scalar stiffness = 0;
  Scalar damping = 0;
  Scalar rest = 0;
};

// Along axis k of the rows.
Law law_along(Eigen::Index k, const SpringState& spring, Scalar middle_length) {
  const SpringDefinition& definition = spring.definition;
  if (k == 0 || spring.rest_length() == 0) {
    return {definition.stiffness, definition.damping, k == 0 ? spring.rest_length() : 0};
  }
  const Scalar share =
      middle_length > 0 ? std::max(0.0, 1 - spring.rest_length() / middle_length) : 0;
  return {share * definition.stiffness, 0, 0};
}

JointRow row_along(const Vector3& axis, const Vector3& arm_a, const Vector3& arm_b) {
  JointRow row;
  row.j_av_W = -axis;
  row.j_aw_W = -arm_a.cross(axis);
  row.j_bv_W = axis;
  row.j_bw_W = arm_b.cross(axis);
  return row;
}

Scalar mobility(const ContactBody& body, const Vector3& j_v, const Vector3& j_w) {
  return j_v.dot(body.inverse_mass_W * j_v) + j_w.dot(body.inverse_inertia_W * j_w);
}

// Whether half a step of the spring's force cannot turn the motion along its row round.
bool is_resolved(const SpringDefinition& spring, const JointRow& row, const SubstepProblem& substep,
                 Scalar tau) {
  const Scalar weight = mobility(substep.problem().bodies[row.body_a], row.j_av_W, row.j_aw_W) +
                        mobility(substep.problem().bodies[row.body_b], row.j_bv_W, row.j_bw_W);
  return (spring.damping + spring.stiffness * tau / 2) * tau / 2 * weight <= 1;
}

}  // namespace

SpringRows::SpringRows(SubstepProblem& substep, Scalar tau) : substep_(substep), tau_(tau) {
  const IslandRun& run = substep.run();
  for (SpringState* spring : run.springs()) {
    const BodyRecord& a = run.context().body(spring->definition.a.slot);
    const BodyRecord& b = run.context().body(spring->definition.b.slot);
    const RigidPose X_WA = run.pose_of(run.member_at(a.id), a);
    const RigidPose X_WB = run.pose_of(run.member_at(b.id), b);
    Entry entry;
    entry.spring = spring;
    entry.body_a = substep.take_body(a);
    entry.body_b = substep.take_body(b);
    entry.arm_a_W = X_WA * spring->definition.p_AP - substep.center_of(entry.body_a);
    entry.arm_b_W = X_WB * spring->definition.p_BQ - substep.center_of(entry.body_b);
    entry.begin_W = spring_vector(spring->definition, X_WA, X_WB);
    entry.axes_W =
        spring->rest_length() > 0 ? axes_along(entry.begin_W) : Matrix3(Matrix3::Identity());
    entry.first_row = substep.problem().rows.size();
    substep.problem().rows.resize(entry.first_row + 3);
    for (Eigen::Index k = 0; k < 3; ++k) {
      substep.problem().rows[entry.first_row + std::size_t(k)].impulse =
          entry.axes_W.col(k).dot(spring->half_impulse_W);
    }
    set_rows(entry);
    if (!is_resolved(spring->definition, substep.problem().rows[entry.first_row], substep, tau)) {
      entry.ahead = 1;
    }
    entries_.push_back(entry);
  }
}

// Jacobians, and impulses turned to the axes.
void SpringRows::set_rows(const Entry& entry) {
  for (Eigen::Index k = 0; k < 3; ++k) {
    JointRow& row = substep_.problem().rows[entry.first_row + std::size_t(k)];
    const Scalar impulse = row.impulse;
    row = row_along(entry.axes_W.col(k), entry.arm_a_W, entry.arm_b_W);
    row.body_a = entry.body_a;
    row.body_b = entry.body_b;
    row.impulse = impulse;
  }
}

// D' with the velocities of the last solve.
Vector3 SpringRows::rate(const Entry& entry) const {
  const ContactBody& a = substep_.problem().bodies[entry.body_a];
  const ContactBody& b = substep_.problem().bodies[entry.body_b];
  return b.v_W + b.w_W.cross(entry.arm_b_W) - a.v_W - a.w_W.cross(entry.arm_a_W);
}

Vector3 SpringRows::impulse(const Entry& entry) const {
  Vector3 sum = Vector3::Zero();
  for (Eigen::Index k = 0; k < 3; ++k) {
    sum += substep_.problem().rows[entry.first_row + std::size_t(k)].impulse * entry.axes_W.col(k);
  }
  return sum;
}

// With D at the part s of the move, 1/2 or 1: impulse = -tau/2 [k (x . (D + s tau (J v) + s error)
// - rest) + c (J v + x . error / tau)], solved for J v. A stiffness over a time weighs like a
// damper.
void SpringRows::set_targets() {
  for (const Entry& entry : entries_) {
    const Vector3 middle = entry.begin_W + entry.ahead * entry.error_W;
    for (Eigen::Index k = 0; k < 3; ++k) {
      JointRow& row = substep_.problem().rows[entry.first_row + std::size_t(k)];
      const Law law = law_along(k, *entry.spring, middle.norm());
      const Vector3 axis = entry.axes_W.col(k);
      // A row without any stiffness stays a row, of no weight.
      const Scalar least =
          kSpringLeastShare * (entry.spring->definition.stiffness * entry.ahead * tau_ +
                               entry.spring->definition.damping);
      const Scalar weight = std::max(law.stiffness * entry.ahead * tau_ + law.damping, least);
      row.compliance = 1 / (tau_ / 2 * weight);
      row.target = -(law.stiffness * (axis.dot(middle) - law.rest) +
                     law.damping * axis.dot(entry.error_W) / tau_) /
                   weight;
    }
  }
}

bool SpringRows::update(const EndPose& end_pose) {
  bool has_changed = false;
  const IslandRun& run = substep_.run();
  for (Entry& entry : entries_) {
    const SpringDefinition& definition = entry.spring->definition;
    const BodyRecord& a = run.context().body(definition.a.slot);
    const BodyRecord& b = run.context().body(definition.b.slot);
    const Vector3 end = spring_vector(definition, end_pose(run.member_at(a.id), a),
                                      end_pose(run.member_at(b.id), b));
    const Vector3 error = end - entry.begin_W - tau_ * rate(entry);
    const Scalar enough = kSpringErrorChange * substep_.rest_offset();
    has_changed = has_changed || (error - entry.error_W).norm() > enough;
    entry.error_W = error;
    if (entry.spring->rest_length() == 0) continue;
    const Vector3 middle = (1 - entry.ahead) * entry.begin_W + entry.ahead * end;
    const Matrix3 axes = axes_along(middle);
    has_changed =
        has_changed || (axes.col(0) - entry.axes_W.col(0)).norm() * middle.norm() > enough;
    const Vector3 known = impulse(entry);
    entry.axes_W = axes;
    for (Eigen::Index k = 0; k < 3; ++k) {
      substep_.problem().rows[entry.first_row + std::size_t(k)].impulse = axes.col(k).dot(known);
    }
    set_rows(entry);
  }
  return has_changed;
}

void SpringRows::keep_impulses(Scalar share) {
  for (const Entry& entry : entries_) entry.spring->half_impulse_W = share * impulse(entry);
}

void SpringRows::add_cut(Scalar share, std::size_t member, Vector3& v_W, Vector3& L_W) const {
  const Matrix3& inverse_mass_W = substep_.problem().bodies[member].inverse_mass_W;
  for (const Entry& entry : entries_) {
    const Vector3 cut = (share - 1) * impulse(entry);
    if (entry.body_a == member) {
      v_W -= inverse_mass_W * cut;
      L_W -= entry.arm_a_W.cross(cut);
    }
    if (entry.body_b == member) {
      v_W += inverse_mass_W * cut;
      L_W += entry.arm_b_W.cross(cut);
    }
  }
}

void add_spring_ends(SubstepProblem& node, Scalar tau, std::vector<Vector3>& free_L_W,
                     VelocityChange* change) {
  const IslandRun& run = node.run();
  for (const SpringState* spring : run.springs()) {
    const SpringDefinition& definition = spring->definition;
    const BodyRecord& a = run.context().body(definition.a.slot);
    const BodyRecord& b = run.context().body(definition.b.slot);
    const RigidPose X_WA = run.pose_of(run.member_at(a.id), a);
    const RigidPose X_WB = run.pose_of(run.member_at(b.id), b);
    const std::size_t body_a = node.take_body(a);
    const std::size_t body_b = node.take_body(b);
    const Vector3 arm_a = X_WA * definition.p_AP - node.center_of(body_a);
    const Vector3 arm_b = X_WB * definition.p_BQ - node.center_of(body_b);
    const Vector3 between = spring_vector(definition, X_WA, X_WB);
    const bool is_line = spring->rest_length() > 0;
    const Matrix3 axes = is_line ? axes_along(between) : Matrix3(Matrix3::Identity());
    Vector3 impulse = spring->half_impulse_W;
    for (Eigen::Index k = 0; k < (is_line ? 1 : 3); ++k) {
      const Vector3 axis = axes.col(k);
      JointRow row = row_along(axis, arm_a, arm_b);
      row.body_a = body_a;
      row.body_b = body_b;
      if (is_resolved(definition, row, node, tau)) continue;
      impulse -= axis * axis.dot(impulse);
      const Scalar implicit = definition.damping + definition.stiffness * tau / 2;
      row.compliance = 1 / (tau / 2 * implicit);
      row.target = -definition.stiffness * (axis.dot(between) - spring->rest_length()) / implicit;
      node.problem().rows.push_back(row);
    }
    const auto kick = [&](std::size_t body, const Vector3& arm, Scalar sign) {
      if (body >= free_L_W.size()) return;
      ContactBody& moved = node.problem().bodies[body];
      free_L_W[body] += sign * arm.cross(impulse);
      moved.free_v_W += sign * (moved.inverse_mass_W * impulse);
      moved.free_w_W = moved.inverse_inertia_W * free_L_W[body];
    };
    kick(body_a, arm_a, -1);
    kick(body_b, arm_b, 1);
    if (change == nullptr) continue;
    change->links.push_back({LinkImpulse::Kind::Spring, a.id, b.id, impulse, -arm_a.cross(impulse),
                             arm_b.cross(impulse)});
  }
}

}  // namespace dyop::dynamics_internal
