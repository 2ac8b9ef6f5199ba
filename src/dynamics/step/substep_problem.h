// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "dynamics/step/end_gap.h"
#include "dynamics/step/island.h"
#include "dyop/core/error.h"

namespace dyop::dynamics_internal {

/// A joint's row in a substep.
struct SubstepRow {
  JointState* joint = nullptr;
  std::size_t index = 0;     // of the joint's rows
  JointEquation equation;    // at the start
  Scalar error = 0;          // end value minus that of the linear prediction
  Scalar change = 0;         // of the error, at the last prediction
  Scalar ahead = 0.5;        // of a Drive: part of the move at whose end its force is taken
  bool is_left_out = false;  // contradicts the rows before it
};

/// Where a contact would be after a substep, and after it at the rate of its start.
struct PredictedEnd {
  EndGap end;
  Scalar linear_gap = 0;
};

/// The contact problem of an island at one time: members first, then bodies that cannot be moved.
class SubstepProblem {
 public:
  explicit SubstepProblem(IslandRun& run);
  ~SubstepProblem();
  SubstepProblem(const SubstepProblem&) = delete;
  SubstepProblem& operator=(const SubstepProblem&) = delete;

  IslandRun& run() { return run_; }
  const IslandRun& run() const { return run_; }
  ContactProblem& problem() { return problem_; }
  const ContactProblem& problem() const { return problem_; }
  std::vector<SubstepContact>& contacts() { return contacts_; }
  const std::vector<SubstepContact>& contacts() const { return contacts_; }

  /// The members' mobilities at these rotations.
  void set_mobility(std::size_t member, const Matrix3& R_WB);
  /// Mean twist over [now, now + tau] of the bodies on prescribed motions; if tau is 0 that with
  /// which the substep ends.
  void set_supports(Scalar tau);
  /// Adds the contacts of all near pairs at now that `wanted` accepts, from the ground up: the
  /// order of the sweeps.
  template <typename Wanted>
  void take_contacts(const Wanted& wanted) {
    std::vector<Place> places;
    for (std::size_t i = 0; i < run_.pairs().size(); ++i) {
      const IslandRun::RunPair& pair = run_.pairs()[i];
      if (!pair.is_near) continue;
      const auto points = pair.state->points();
      for (std::size_t k = 0; k < points.size(); ++k) {
        if (wanted(pair, points[k])) places.push_back({i, k, height_of(points[k])});
      }
    }
    add_from_below(std::move(places));
  }
  void add(const SubstepContact& contact);
  /// A contact where a move of length tau was hit; one that is known there is pushed harder.
  /// Returns by how much more than its gap.
  Scalar add_hit(std::size_t pair, const ContactPoint& point, Scalar tau);
  /// A contact beside a hit: one that is known there is pushed at least as hard.
  void add_beside_hit(std::size_t pair, const ContactPoint& point, Scalar tau, Scalar push);
  /// Adds the rows of all joints at now; motors have their strength over tau. Of joints in a loop
  /// that do not fit together, those rows get no impulse that contradict others.
  void take_joints(Scalar tau);
  std::vector<SubstepRow>& rows() { return rows_; }
  const std::vector<SubstepRow>& rows() const { return rows_; }
  /// Appends rows that help to find the impulses of joints, and have none themselves in the end.
  void add_soft_joint_rows(std::size_t count);
  void set_row_target(std::size_t row, Scalar target) { problem_.rows[row].target = target; }
  /// J v with the velocities of the last solve.
  Scalar row_velocity(std::size_t row) const;
  /// Stores the impulses of the rows as the joints' warm start.
  void keep_row_impulses();

  /// Solves for the targets; impulses are kept as the next warm start. An impact, which has no next
  /// step to correct its error, is solved down to rounding.
  ContactReport solve(Scalar tau, bool is_impact = false);
  void set_target(std::size_t contact, Scalar target) {
    problem_.contacts[contact].target = target;
  }
  /// Under a friction law: gives a contact the coefficient at this velocity of B's point relative to
  /// A's, whatever it slides with after the solve. Either all contacts or none.
  void fix_friction(std::size_t contact, const Vector3& velocity_W);
  /// Takes a contact's end from a prediction before the first solve.
  void predict_end(std::size_t contact, const PredictedEnd& predicted);
  /// Takes a contact's end after the last solve: corrects the prediction of its gap, and lets it
  /// stick where it is in the middle of a substep of length tau, not where it was at the start.
  /// Returns whether that changes so much that the solve must be repeated.
  bool take_end(std::size_t contact, const EndGap& end, Scalar tau);
  /// Whether both bodies move so nearly as when the end was last taken that it is not worth finding
  /// again: the correction of its gap is the same. Estimates of an overlap have none.
  bool end_is_known(std::size_t contact, Scalar tau) const;
  /// Whether a contact is expected to end nearer than its pair may be.
  bool ends_short(std::size_t contact, Scalar tau) const;

  /// Least normal velocity of a contact in a substep of length tau: keeps the rest gap until the
  /// end, or recovers a part of it at bounded speed, and keeps a corner that turns away from
  /// dipping on the way. Uses the error of the last prediction and the velocities of the last
  /// solve.
  Scalar least_velocity(std::size_t contact, Scalar tau) const;
  /// Bound on the part of it that the bodies' turns and curved surfaces ask for, whatever the gap
  /// is.
  Scalar bending_velocity(std::size_t contact, Scalar tau) const;

  /// Sets all targets for a substep of length tau; without recovery none is above zero, so that
  /// "move along together" is feasible.
  void set_targets(Scalar tau, bool recovers);
  /// Whether hits have changed the problem since the targets were set for `known` contacts: added
  /// some, or ask more of those.
  bool asks_more(std::size_t known, Scalar tau, bool recovers) const;

  /// What the last solve lets a contact on a curved surface do.
  CurvedMove curved_move(std::size_t contact, Scalar tau) const;
  /// The gap of a contact after tau at the rate that the last solve gives it.
  Scalar linear_gap(std::size_t contact, Scalar tau) const;
  /// Velocity of B's point relative to A's after the last solve.
  Vector3 relative_velocity(std::size_t contact) const;
  /// Angular velocity of B relative to A after the last solve.
  Vector3 relative_turn(std::size_t contact) const;
  /// Angular momenta of the members after the impulses of the last solve, given those before.
  std::vector<Vector3> angular_momenta(std::vector<Vector3> free_L_W) const;
  /// Whether the impulses of the last solve raised the energy of an impact: each of them, J, does the
  /// work J (u- + u+) / 2 between its bodies, u their relative velocity there before and after.
  bool has_gained_energy(Scalar tau) const;
  /// Adds the impulses of the last solve; only `share` of those of springs acts.
  void add_impulses(VelocityChange& change, Scalar share = 1) const;
  BodyId id_of(std::size_t body) const;
  std::size_t body_index(const std::optional<std::size_t>& member, const BodyRecord& body) const;
  /// Whether the impulses of the last solve turn a member by so much in a substep of length tau
  /// that where its contacts will be by then is a guess.
  bool turns_too_far(Scalar tau) const;
  /// Shorter substeps recover gaps no faster than this one, and are solved as exactly: else the
  /// recovery would need velocities without bound. 0: nothing moves. Time.
  Scalar least_substep() const;
  /// Whether there are joints, and no contact got an impulse in the last solve.
  bool is_held_by_joints() const;
  /// Whether so many bodies with so many contacts move so fast that they are solved coarsely, in
  /// short substeps. What hits add during a substep does not change it.
  bool is_coarse() const;
  /// Whether so many bodies without joints move so fast that they are not a structure.
  bool is_crowd() const;
  /// Whether loads that the contacts do not determine are solved so coarsely that they drift: in an
  /// island that moves by more than what is at rest in a substep of length tau. Not told of a large
  /// one, where the loads of the last solve are worth more.
  bool loads_may_drift(Scalar tau) const;
  /// The pair with the prescribed motion that works against a self-stress of the contacts, as the
  /// substep asks for them or with those that carry closed; none if there is none, not even nearly.
  std::optional<PairKey> locked_by_friction() const;
  /// Number in the problem of a body that something other than a contact acts on.
  std::size_t take_body(const BodyRecord& body);
  /// Centre of mass at now.
  Vector3 center_of(std::size_t body) const { return centers_[body]; }
  /// Smallest rest offset of the island's pairs.
  Scalar rest_offset() const { return rest_offset_; }

 private:
  struct Place {  // of a contact
    std::size_t pair = 0;
    std::size_t index = 0;  // into the pair's contacts
    Scalar height = 0;
  };

  Scalar height_of(const ContactPoint& point) const {
    return -run_.context().gravity_W.dot(point.p_WCa);
  }
  void add_from_below(std::vector<Place> places);
  void leave_out_rows();
  bool is_of_joint(std::size_t row) const;
  SubstepContact* known_at(std::size_t pair, const ContactPoint& point, Scalar tau);
  bool is_large() const;
  bool is_of_balls() const;
  bool is_large_and_moves() const;
  int first_sweeps() const;
  bool may_sleep() const;
  // Returns by how much the velocity that counts as sticking changes.
  Scalar stick_midway(std::size_t contact, const Vector3& p_W_end, Scalar tau);
  Scalar recovery_cap(std::size_t contact, Scalar tau) const;  // largest target above zero
  Scalar target_of_substep(std::size_t contact, Scalar tau, bool recovers) const;
  Scalar tolerance(Scalar tau) const;
  ContactReport solve_with(const ContactSolverOptions& options, int first_sweeps);
  Scalar impact_tolerance(Scalar tau) const;
  Scalar friction_by_law(std::size_t contact, const Vector3& sliding_W) const;

  struct TakenEnd {  // when the end of a contact was taken
    Vector3 v_a_W, w_a_W, v_b_W, w_b_W;
    Scalar tolerance = -1;  // how far points may move away from there, length; none taken yet: -1
  };

  IslandRun& run_;
  SubstepMemory memory_;  // the workspace's, for the life of this object
  ContactProblem& problem_ = memory_.problem;
  std::vector<SubstepContact>& contacts_ = memory_.contacts;
  std::vector<SubstepRow> rows_;
  std::size_t first_soft_row_ = std::numeric_limits<std::size_t>::max();
  std::vector<TakenEnd> ends_;  // by contact
  void ensure_support(const std::optional<std::size_t>& member, const BodyRecord& body);
  std::vector<Vector3> centers_;                                 // by body of the problem
  std::vector<std::pair<std::uint32_t, std::size_t>> supports_;  // slot, body of the problem
  std::size_t first_contacts_ = 0;                               // without those from hits
  std::size_t ball_contacts_ = 0;                                // of pairs with a ball
  bool has_fixed_friction_ = false;
  Scalar rest_offset_ = kInfinity;
  Vector3 carried_W_ = Vector3::Zero();  // velocity of what carries the island, such as a belt
  Scalar start_speed_ = 0;               // of the fastest member relative to that, turning included
  Scalar slack_ = 0;  // of ends: a smaller change is within what the last solve left; length
};

}  // namespace dyop::dynamics_internal
