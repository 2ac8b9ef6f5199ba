// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "dynamics/step/island.h"
#include "dynamics/step/substep_problem.h"
#include "dyop/core/export.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/core/types.h"

namespace dyop::dynamics_internal {

/// The constant angular velocity that takes a body without torque from R_WB to where it is after
/// tau, given the inverse of its inertia about the centre of mass. Several do; this is the one nearest
/// to w_W. Returns w_W itself for turns of thousands of radians, which are not followed.
DYOP_EXPORT Vector3 mean_free_velocity(const Matrix3& inverse_inertia_B, const Matrix3& R_WB,
                                       const Vector3& L_W, Scalar tau, const Vector3& w_W);

/// The same for a body with locked rotations. The locks change L about their own axes only, where it
/// does not count.
DYOP_EXPORT Vector3 mean_locked_velocity(const BodyRecord& body, const Matrix3& R_WB,
                                         const Vector3& L_W, Scalar tau, const Vector3& w_W);

/// How the members of an island turn in a move of length tau. Impulses act at its start; after them
/// a body turns as it does without torque, so it keeps its energy, however thin it is and however far
/// it turns.
///
/// Each solve uses the mobility at the start of the move, which is exact for impulses across the axis
/// of a thin body, and corrects the velocity for the turn that the impulses of the last solve lead
/// to.
class FreeTurns {
 public:
  FreeTurns(const IslandRun& run, Scalar tau);

  /// Sets the members' mobilities and free angular velocities, given their angular momenta before
  /// the impulses.
  void set_free_velocities(const std::vector<Vector3>& L_W, ContactProblem& problem);
  /// Takes the members' angular momenta after the impulses of the last solve. Returns whether some
  /// turn so differently that the solve must be repeated.
  bool follow(const SubstepProblem& substep, std::vector<Vector3> L_W);
  /// Whether the last solve turns a member so that its energy changes without work. Then the move
  /// must be shorter.
  bool change_energy(const SubstepProblem& substep) const;
  /// Whether the joints of an island on which nothing else acts add energy to it, given what the
  /// members keep after the move, and where they are then. Then the move must be shorter too.
  bool joints_add_energy(const SubstepProblem& substep, std::span<const Vector3> v_W,
                         std::span<const Vector3> L_W, std::span<const RigidPose> ends) const;

 private:
  Vector3 correction(std::size_t member, const Vector3& L_W, const Vector3& w_W) const;

  const IslandRun& run_;
  Scalar tau_;
  bool is_first_ = true;
  std::vector<Vector3> free_L_W_;       // before the impulses
  std::vector<Vector3> L_W_;            // after those of the last solve
  std::vector<Vector3> corrections_W_;  // of w = mobility L, by member
};

}  // namespace dyop::dynamics_internal
