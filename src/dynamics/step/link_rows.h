// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "dynamics/link_state.h"
#include "dynamics/step/substep_problem.h"
#include "dyop/contact/contact_problem.h"
#include "dyop/core/export.h"

namespace dyop::dynamics_internal {

/// Pose of the frame B of a body at the time of interest.
using EndPose =
    std::function<RigidPose(const std::optional<std::size_t>& member, const BodyRecord& body)>;

/// The frames of a joint, or of those it couples, at now.
JointPlaces joint_places(const IslandRun& run, const JointState& joint);

/// Brings the angles of the island's joints to now, given the angular velocities with which its
/// members have turned for a time tau, by member; none: they have hardly turned.
void follow_joint_angles(IslandRun& run, const std::vector<Vector3>& w_W, Scalar tau);

/// Targets of the joints' rows for a move of length tau: they close the joint's errors, no faster
/// than bodies that began too near are pushed apart, and undo all that the substep itself would
/// add. Drives get half their impulse, of the force at the middle of the move, like springs.
void set_joint_targets(SubstepProblem& substep, Scalar tau);

/// Compares the joints at the end with their linear prediction. Returns whether it has changed so
/// much that the solve must be repeated.
bool update_joint_errors(SubstepProblem& substep, Scalar tau, const EndPose& end_pose);

/// The second half of the drives' impulses at the end of a substep of length tau, as of springs.
/// @param change Gets the impulses that are not left to rows; may be null.
void add_drive_ends(SubstepProblem& node, Scalar tau, std::vector<Vector3>& free_L_W,
                    VelocityChange* change);

/// Had the substep been cut to `share` of its length, a member would have got less from drives:
/// adds what is to be taken away, and keeps the rest for the end.
void cut_drives(const SubstepProblem& substep, Scalar share, std::vector<Vector3>& v_W,
                std::vector<Vector3>& L_W);

/// Adds the impulses of the last solve to what the joints have borne in this step.
void add_reactions(SubstepProblem& substep);

/// Substeps of this part of a step are not shortened for what a joint does.
inline constexpr Scalar kLeastJointedSubstep = 1.0 / 64;  // of a turn a step: a tenth of a radian

/// Whether the prediction of a joint's end still changes much: the bodies turn too far in a substep
/// of length tau to be held, and a shorter one is needed.
bool joints_are_guessed(const SubstepProblem& substep, Scalar tau);

/// A row of a joint that holds a coordinate at zero.
struct HeldRow {
  std::size_t joint = 0;  ///< rows of one joint follow each other
  const JointRow* row = nullptr;
  Scalar value = 0;   ///< of the coordinate, length
  Scalar radius = 0;  ///< of the smaller body
};

/// Joints that close a loop hold some coordinates twice: a door on two hinges is held by ten rows
/// where five are enough. As long as the joints fit together that does no harm. If the second hinge
/// is off the axis of the first by a rounded decimal, no motion closes both, and the rows together
/// hold the door, or drive it at any speed.
///
/// Finds the rows of such loops that the rows before them imply, up to a few misfits, if what they
/// ask for contradicts those: they are to be left out, and stay open by their misfit. Loops that fit
/// together keep all their rows.
/// @param bodies Those from `movable` on cannot be moved.
/// @return Numbers of rows, ascending. Loops of more than 400 rows are not looked at.
DYOP_EXPORT std::vector<std::size_t> find_contradicting_rows(std::span<const HeldRow> rows,
                                                             std::span<const ContactBody> bodies,
                                                             std::size_t movable);

/// Whether joints close errors so fast that the bodies turn by that rather than by their velocities.
bool joint_recovery_prevails(const SubstepProblem& substep, Scalar tau);

/// Removes from the targets what only recovers errors of position, and without `bends` also what
/// the joint needs because it turns. Returns whether there was any.
bool release_joint_recovery(SubstepProblem& substep, Scalar tau, bool bends);

/// Joints whose tension turns a body round faster than a move of length tau resolves, as the links
/// of a rope with a heavy load: then all joints of the island act along their rows in the middle of
/// the move, with the same impulses in its two halves, the implicit midpoint rule. Their arms are the
/// means of those at its ends. Otherwise they act along those at its start and its end, which keeps
/// energy better.
///
/// A force F at the arm r from the centre of mass resists turns by K = F . r - (r F^T + F r^T) / 2;
/// with K tau / 2 added to the inertia a repeated solve is a Newton step. A rod of length l under
/// tension F, or a taut rope, resists motions of its ends across it by F / l, as two soft rows. [Tournier2015]
class JointTension {
 public:
  /// After the rows of joints have been taken.
  JointTension(SubstepProblem& substep, Scalar tau);

  /// Adds the stiffness of the joints' present impulses to the members' inertia, whose mobilities
  /// and free velocities have been set, around the velocities of the last solve.
  void stiffen();
  /// Takes the stiffness away again: the last solve's impulses were those of a recovery.
  void relax(const std::vector<Vector3>& free_L_W);
  /// Takes the rows where the last solve has its bodies in the middle of the move. Returns whether
  /// they turned so much that the solve must be repeated.
  bool follow();
  /// Keeps the impulses of the last solve for the end of the move, unless it was cut.
  void keep_ends(bool is_cut) const;

 private:
  struct Joint {
    JointState* state = nullptr;
    std::size_t first_row = 0;
    std::size_t last_row = 0;
    Vector3 arm_a_W;
    Vector3 arm_b_W;
    std::optional<std::size_t> rod{};           // the row of a rod, or of a rope that stays taut
    std::optional<std::size_t> first_across{};  // of a rod's two soft rows
    bool has_turned = false;                    // a rod, since the last solve's linearisation
  };
  std::optional<std::size_t> rod_of(const Joint& joint) const;
  bool is_in_middle(const Joint& joint, std::size_t row) const;
  Scalar stiffness_across(const Joint& rod) const;
  void set_across(Joint& rod);
  void measure();
  void take_middle_rows(Joint& joint);
  JointPlace place_at(Scalar part, const JointState& joint) const;

  SubstepProblem& substep_;
  Scalar tau_;
  bool is_stiff_ = false;
  std::vector<Joint> joints_;
  std::vector<Matrix3> stiffness_;  // times tau / 2, by member
  std::vector<Vector3> around_W_;   // angular velocities of the last solve's linearisation
};

/// The impulses that JointTension has kept act again, on the members' free velocities.
/// @param change Gets them; may be null.
void add_tension_ends(SubstepProblem& node, std::vector<Vector3>& free_L_W, VelocityChange* change);

/// The springs of an island in one move of length tau, by the implicit midpoint rule: half the
/// impulse of the force at the middle of the move acts in the move, as three soft rows of the
/// contact problem each; the other half at its end.
///
/// With D from P to Q, its middle value D_m = (D_begin + D_end) / 2 and u = D / |D_m|, the force on
/// B along an axis x is -k_x (x . D_m - rest_x) - c_x x . D', D' = (D_end - D_begin) / tau: along
/// u with stiffness, damping and rest length, across it with the stiffness k (1 - rest / |D_m|)
/// that a stretched spring has there. A spring that the step does not resolve takes its force at
/// the end of the move instead.
class SpringRows {
 public:
  /// Adds the rows, after those of joints.
  SpringRows(SubstepProblem& substep, Scalar tau);

  void set_targets();
  /// Compares the ends with their linear prediction. Returns whether the solve must be repeated.
  bool update(const EndPose& end_pose);
  /// The velocities of the last solve, had the substep been cut to `share` of tau, differ by the
  /// rest of the impulses: keeps what remains of them for the end.
  void keep_impulses(Scalar share);
  /// Impulse on a member by the half that was cut off, to be added.
  void add_cut(Scalar share, std::size_t member, Vector3& v_W, Vector3& L_W) const;

 private:
  struct Entry {
    SpringState* spring = nullptr;
    std::size_t body_a = 0;  // of the problem
    std::size_t body_b = 0;
    Vector3 arm_a_W;  // from the centre of mass at the start
    Vector3 arm_b_W;
    Vector3 begin_W;                    // D at the start
    Vector3 error_W = Vector3::Zero();  // D at the end minus its linear prediction
    Matrix3 axes_W;                     // columns; the first along the spring
    Scalar ahead = 0.5;                 // part of the move at whose end the force is taken
    std::size_t first_row = 0;
  };
  void set_rows(const Entry& entry);
  Vector3 impulse(const Entry& entry) const;
  Vector3 rate(const Entry& entry) const;

  SubstepProblem& substep_;
  Scalar tau_;
  std::vector<Entry> entries_;
};

/// The second half at the end of a substep of length tau, on the members' free velocities. A spring
/// or damper that would turn a motion round within the half step is solved implicitly there too, as
/// a row that looks half a step ahead: what the step cannot resolve dies down.
/// @param change Gets the impulses that are not left to rows; may be null.
void add_spring_ends(SubstepProblem& node, Scalar tau, std::vector<Vector3>& free_L_W,
                     VelocityChange* change);

}  // namespace dyop::dynamics_internal
