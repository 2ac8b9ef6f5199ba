// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/free_turns.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "dynamics/free_flight.h"
#include "dynamics/step/link_rows.h"
#include "dyop/core/rigid_pose.h"

namespace dyop::dynamics_internal {

namespace {

// Radians, times the ratio of the moments of inertia: up to here three terms of a series are enough,
// to a part of 1e-6 of the turn.
constexpr Scalar kSmallTurn = 0.03;
// Radians, times the same ratio, that a body with locked rotations turns in one piece, and the most
// pieces of a move.
constexpr Scalar kLockedPiece = 0.2;
constexpr Scalar kMostLockedPieces = 2000;
// The solve is repeated if a point of the body would be elsewhere by this part of the rest offset.
constexpr Scalar kTurnChange = 0.01;
// Of the energy of a member, in one move: by its turn, which should change none. Where joints alone
// act nothing takes a small gain away again, and rods that spin fast would exchange their spin for
// other motions; there solves are repeated to the last value.
constexpr Scalar kMostEnergyChange = 1e-3;
constexpr Scalar kMostJointedEnergyChange = 1e-6;  // literal: a part of 1e-3 in a thousand moves
constexpr Scalar kSolvedEnergyChange = 1e-8;       // literal: far below that
// Of the energy of an island, in one move.
constexpr Scalar kMostJointGain = 3e-3;
// In one that is too short to be shortened for a little.
constexpr Scalar kMostShortJointGain = 0.5;

Scalar kinetic_energy(const BodyRecord& body, const Vector3& v_W, const Matrix3& R_WB,
                      const Vector3& L_W) {
  return (v_W.squaredNorm() / body.inverse_mass + L_W.dot(body.angular_velocity(R_WB, L_W))) / 2;
}

// Of a body that moves by the rest offset in a step.
Scalar slow_energy(const SubstepProblem& substep, const BodyRecord& body) {
  const Scalar slowly = substep.rest_offset() / substep.run().context().h;
  return slowly * slowly / (2 * body.inverse_mass);
}

// Whether nothing but joints that do no work acts on the members.
bool is_held_by_joints_alone(const SubstepProblem& substep) {
  if (!substep.is_held_by_joints() || !substep.run().springs().empty()) return false;
  const std::vector<ContactBody>& bodies = substep.problem().bodies;
  const std::size_t count = substep.run().members().size();
  return std::all_of(
             substep.rows().begin(), substep.rows().end(),
             [](const SubstepRow& row) {
               const JointEquation& equation = row.equation;
               return equation.kind != JointEquation::Kind::Drive &&
                      (equation.kind != JointEquation::Kind::Motor || equation.row.target == 0);
             }) &&
         std::all_of(bodies.begin() + std::ptrdiff_t(count), bodies.end(),
                     [](const ContactBody& support) {
                       return support.v_W.isZero(0) && support.w_W.isZero(0);
                     });
}

// The rotation vector after tau of a body that turns by little. In its own axes L' = L x w, and the
// vector's rate is w + theta x w / 2 + ... ([Iserles2000]).
Vector3 small_turn(const Matrix3& inverse_inertia_B, const Vector3& L_B, Scalar tau) {
  const Vector3 w = inverse_inertia_B * L_B;
  const Vector3 L_1 = L_B.cross(w);
  const Vector3 w_1 = inverse_inertia_B * L_1;
  const Vector3 w_2 = inverse_inertia_B * (L_1.cross(w) + L_B.cross(w_1));
  return tau * (w + tau / 2 * (w_1 + tau / 6 * (2 * w_2 + w.cross(w_1))));
}

// Of the rotation vectors that turn as theta does, the one nearest to `guess`.
Vector3 nearest_branch(const Vector3& theta, const Vector3& guess) {
  constexpr Scalar kRound = 2 * std::numbers::pi;
  const Scalar angle = theta.norm();
  if (!(angle > 0)) return theta;
  const Scalar rounds = std::round((guess.dot(theta) / angle - angle) / kRound);
  return (1 + rounds * kRound / angle) * theta;
}

}  // namespace

Vector3 mean_free_velocity(const Matrix3& inverse_inertia_B, const Matrix3& R_WB,
                           const Vector3& L_W, Scalar tau, const Vector3& w_W) {
  constexpr int kMostPieces = 5000;
  const Vector3 L_B = R_WB.transpose() * L_W;
  if (tau * inverse_inertia_B.norm() * L_B.norm() <= kSmallTurn) {
    return R_WB * small_turn(inverse_inertia_B, L_B, tau) / tau;
  }
  Matrix3 R = R_WB;
  Scalar left = tau;
  for (int piece = 0; left > 0; ++piece) {
    const TorqueFreeTurn turn(inverse_inertia_B, R.transpose() * L_W);
    if (piece == kMostPieces || left > kMostPieces * turn.span()) return w_W;
    const Scalar length = std::min(left, turn.span());
    R = R * rotation_from_vector(turn.at(length).theta);
    left -= length;
  }
  return nearest_branch(rotation_vector(R * R_WB.transpose()), tau * w_W) / tau;
}

// In steps of fourth order ([Celledoni2003]).
Vector3 mean_locked_velocity(const BodyRecord& body, const Matrix3& R_WB, const Vector3& L_W,
                             Scalar tau, const Vector3& w_W) {
  const Scalar fastest = body.inverse_inertia_B.norm() * L_W.norm();
  const Scalar pieces = std::max(std::ceil(tau * fastest / kLockedPiece), 1.0);
  if (!(pieces <= kMostLockedPieces)) return w_W;
  const Scalar h = tau / pieces;
  Matrix3 R = R_WB;
  for (int i = 0; i < int(pieces); ++i) {
    const Vector3 k_1 = body.angular_velocity(R, L_W);
    const Matrix3 R_2 = rotation_from_vector(h / 2 * k_1) * R;
    const Vector3 k_2 = body.angular_velocity(R_2, L_W);
    const Vector3 k_3 = body.angular_velocity(rotation_from_vector(h / 2 * k_2) * R, L_W);
    const Vector3 k_4 =
        body.angular_velocity(rotation_from_vector(h * k_3 - h / 2 * k_1) * R_2, L_W);
    R = rotation_from_vector(h / 12 * (3 * k_1 + 2 * (k_2 + k_3) - k_4)) * R;
    R = rotation_from_vector(h / 12 * (3 * k_4 + 2 * (k_2 + k_3) - k_1)) * R;
  }
  return nearest_branch(rotation_vector(R * R_WB.transpose()), tau * w_W) / tau;
}

FreeTurns::FreeTurns(const IslandRun& run, Scalar tau)
    : run_(run), tau_(tau), corrections_W_(run.members().size(), Vector3::Zero()) {}

Vector3 FreeTurns::correction(std::size_t member, const Vector3& L_W, const Vector3& w_W) const {
  if (L_W.isZero(0)) return Vector3::Zero();
  const BodyRecord& body = *run_.members()[member].body;
  const Matrix3& R = run_.members()[member].state.X_WM.rotation();
  const Vector3 mean_W = body.definition.locked.any_rotation()
                             ? mean_locked_velocity(body, R, L_W, tau_, w_W)
                             : mean_free_velocity(body.inverse_inertia_B, R, L_W, tau_, w_W);
  return mean_W - body.angular_velocity(R, L_W);
}

void FreeTurns::set_free_velocities(const std::vector<Vector3>& L_W, ContactProblem& problem) {
  free_L_W_ = L_W;
  for (std::size_t i = 0; i < L_W.size(); ++i) {
    const IslandRun::Member& member = run_.members()[i];
    ContactBody& body = problem.bodies[i];
    const Matrix3& R = member.state.X_WM.rotation();
    if (is_first_)
      corrections_W_[i] = correction(i, L_W[i], member.body->angular_velocity(R, L_W[i]));
    body.inverse_inertia_W = member.body->angular_mobility(R);
    body.free_w_W = body.inverse_inertia_W * L_W[i] + corrections_W_[i];
  }
  is_first_ = false;
}

bool FreeTurns::follow(const SubstepProblem& substep, std::vector<Vector3> L_W) {
  L_W_ = std::move(L_W);
  const Scalar most_energy = substep.is_held_by_joints() ? kSolvedEnergyChange : kMostEnergyChange;
  bool has_changed = false;
  for (std::size_t i = 0; i < L_W_.size(); ++i) {
    const Vector3 before_W = corrections_W_[i];
    corrections_W_[i] = correction(i, L_W_[i], substep.problem().bodies[i].w_W);
    const Vector3 change_W = tau_ * (corrections_W_[i] - before_W);
    const Vector3& w_W = substep.problem().bodies[i].w_W;
    const BodyRecord& body = *run_.members()[i].body;
    const Scalar energy = w_W.dot(L_W_[i]) / 2 + slow_energy(substep, body);
    has_changed = has_changed ||
                  change_W.norm() * body.radius > kTurnChange * substep.rest_offset() ||
                  std::abs(change_W.dot(w_W.cross(L_W_[i]))) > 2 * most_energy * energy;
  }
  return has_changed;
}

bool FreeTurns::joints_add_energy(const SubstepProblem& substep, std::span<const Vector3> v_W,
                                  std::span<const Vector3> L_W,
                                  std::span<const RigidPose> ends) const {
  const Scalar h = run_.context().h;
  if (!is_held_by_joints_alone(substep)) return false;
  Scalar before = 0;
  Scalar after = 0;
  Scalar recovery = 0;  // may be this fast
  for (std::size_t i = 0; i < L_W.size(); ++i) {
    const BodyRecord& body = *run_.members()[i].body;
    const Matrix3& R = run_.members()[i].state.X_WM.rotation();
    before += kinetic_energy(body, substep.problem().bodies[i].free_v_W, R, free_L_W_[i]);
    after += kinetic_energy(body, v_W[i], ends[i].rotation(), L_W[i]);
    recovery += slow_energy(substep, body);
  }
  const Scalar most = tau_ > kLeastJointedSubstep * h ? kMostJointGain : kMostShortJointGain;
  return after - before > most * after + recovery;
}

bool FreeTurns::change_energy(const SubstepProblem& substep) const {
  const bool is_exact =
      substep.is_held_by_joints() && tau_ > kLeastJointedSubstep * run_.context().h;
  const Scalar most = is_exact ? kMostJointedEnergyChange : kMostEnergyChange;
  for (std::size_t i = 0; i < L_W_.size(); ++i) {
    if (L_W_[i].isZero(0)) continue;
    const BodyRecord& body = *run_.members()[i].body;
    const ContactBody& moved = substep.problem().bodies[i];
    const Matrix3& R = run_.members()[i].state.X_WM.rotation();
    const Matrix3 R_end = rotation_from_vector(tau_ * moved.w_W) * R;
    const Scalar at_start = kinetic_energy(body, moved.v_W, R, L_W_[i]);
    const Scalar at_end = kinetic_energy(body, moved.v_W, R_end, L_W_[i]);
    if (std::abs(at_end - at_start) > most * (at_start + slow_energy(substep, body))) return true;
  }
  return false;
}

}  // namespace dyop::dynamics_internal
