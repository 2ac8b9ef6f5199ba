// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <iosfwd>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "dyop/contact/contact_point.h"
#include "dyop/core/time_interval.h"
#include "dyop/distance/distance.h"
#include "dyop/dynamics/integrator.h"
#include "dyop/dynamics/joint.h"
#include "dyop/dynamics/rigid_body.h"
#include "dyop/motion/motion.h"
#include "dyop/toi/toi_result.h"

namespace DYOP_EXPORT dyop {

/// One touching point of two bodies at an impact.
struct WorldContact {
  BodyId a;
  BodyId b;
  Contact contact;
  Scalar normal_velocity = 0;           ///< rate of the gap before the impulse; negative: closing
  Vector3 impulse_W = Vector3::Zero();  ///< on B at p_WCb; on A the opposite
};

/// Everything known about one impact.
struct ImpactEvent {
  Scalar t = 0;  ///< = toi.t_safe
  BodyId a;      ///< the pair that met first
  BodyId b;
  ToiResult toi;
  std::vector<WorldContact> contacts;  ///< all contacts that the impact law was solved for
};

/// What changed velocities at an instant.
enum class VelocityChangeKind : std::uint32_t {
  Move = 0,    ///< first half of a contact substep, over which the bodies then move
  End = 1,     ///< its second half, at the poses it ended at
  Impact = 2,  ///< one round of the impact law
  Stall = 3,   ///< no motion was found: the bodies were stopped
  Sleep = 4,   ///< the bodies fell asleep
  Set = 5,     ///< the caller, or ImpactPolicy::Callback
};

/// The impulse of one contact.
struct ContactImpulse {
  BodyId a;
  BodyId b;
  Vector3 p_W = Vector3::Zero();        ///< where it acts on both bodies
  Vector3 nhat_AB_W = Vector3::Zero();  ///< unit
  Vector3 impulse_W = Vector3::Zero();  ///< on B; on A the opposite
  Scalar target = 0;                    ///< normal velocity (B relative to A) that was asked for
  Scalar friction = 0;                  ///< coefficient; NaN under WorldOptions::friction_law
};

/// What a joint, a spring or the rolling friction of a contact did.
struct LinkImpulse {
  enum class Kind : std::uint32_t { Joint = 0, Spring = 1, Rolling = 2 };
  Kind kind = Kind::Joint;
  BodyId a;
  BodyId b;
  Vector3 impulse_W = Vector3::Zero();    ///< on B; on A the opposite
  Vector3 angular_a_W = Vector3::Zero();  ///< on A, about its centre of mass
  Vector3 angular_b_W = Vector3::Zero();  ///< on B, about its centre of mass
};

/// Velocity of a body's centre of mass and angular momentum about it, world axes.
struct MomentumChange {
  BodyId body;
  Vector3 v_before_W = Vector3::Zero();
  Vector3 L_before_W = Vector3::Zero();
  Vector3 v_W = Vector3::Zero();  ///< after
  Vector3 L_W = Vector3::Zero();
  Vector3 impulse_W = Vector3::Zero();          ///< of gravity and the body's own wrench
  Vector3 angular_impulse_W = Vector3::Zero();  ///< about the centre of mass
};

/// Bodies whose velocities changed together, and all impulses that did it: along its free axes each
/// body's momenta change by the sum of the impulses on it. Between two changes a body keeps them,
/// or flies. Of a contact only impulses that are not zero are listed.
///
/// The twists along which bodies move in a contact substep are not these velocities: they may also
/// recover gaps.
struct VelocityChange {
  VelocityChangeKind kind = VelocityChangeKind::Set;
  TimeInterval interval;  ///< Move, End: the substep; else one time
  std::vector<MomentumChange> bodies;
  std::vector<ContactImpulse> contacts;
  std::vector<LinkImpulse> links;
};

/// The start or end of an overlap between a body and a sensor. The next step
/// reports one that set_state() or the like ended, except of a removed body.
struct SensorEvent {
  BodyId sensor;
  BodyId body;
  Scalar t = 0;             ///< when it was noticed
  bool is_overlap = false;  ///< begins (true) or ends (false)
};

/// Two bodies begin to touch or cease to: within half a rest offset of the gap at which they rest;
/// for the end, beyond where contacts are sought.
struct ContactEvent {
  BodyId a;
  BodyId b;
  Scalar t = 0;  ///< of an impact, else the end of the step in which it was noticed
  bool is_begin = false;
};

/// A joint that bore more than it can over a step and was removed at its end.
struct BrokenJoint {
  JointId joint;
  std::string name;
  BodyId a;
  BodyId b;
  Scalar t = 0;       ///< the end of the step
  Scalar force = 0;   ///< mean over the step, as JointValues::force_W
  Scalar torque = 0;  ///< likewise, JointValues::torque_W
};

enum class AdvanceStatus {
  NotRun,
  Completed,        ///< reached the requested end
  StoppedAtImpact,  ///< policy Stop: at t_safe of the last event
  BudgetExhausted,  ///< budget or deadline used up: safe and committed up to time()
  NumericalLimit,   ///< rounding forbids the distances asked for: safe and committed up to time()
  Blocked,          ///< geometrically or frictionally infeasible: safe up to time()
  Cancelled,        ///< the caller stopped it: safe and committed up to time()
};

/// The enumerator's name.
std::string_view name_of(AdvanceStatus status);
std::ostream& operator<<(std::ostream& out, AdvanceStatus status);

/// One committed step: over its interval every body follows its Motion.
struct CommittedStep {
  TimeInterval interval;
  std::vector<std::shared_ptr<const Motion>>
      motions;  ///< by BodyId::slot; null: removed or disabled
};

/// Counts over the steps of one advance().
struct StepStatistics {
  std::int64_t steps = 0;        ///< of the World
  std::int64_t substeps = 0;     ///< substeps taken, summed over islands
  std::int64_t islands = 0;      ///< that were stepped
  std::int64_t rounds = 0;       ///< contact solves with new constraints from hits
  std::int64_t stalls = 0;       ///< substeps in which no motion was found: the island stood still
  std::int64_t contacts = 0;     ///< largest number at once
  std::int64_t unconverged = 0;  ///< contact solves that ended above their tolerance
  Scalar residual = 0;           ///< the largest, length per time
  Scalar shortest_gap = kInfinity;  ///< of a contact at the end of a step, length
  std::int64_t pairs_by_bound = 0;
  std::int64_t pairs_by_query = 0;
  std::int64_t pairs_at_rest = 0;
  std::int64_t pairs_excused = 0;
  /// Islands that met another one and were stepped again with it. Their times, queries and solves
  /// above the tolerance count; their substeps, rounds and stalls do not.
  std::int64_t discarded_runs = 0;
};

/// How long the parts of an advance() took, in seconds; under WorldOptions::measures_time. All but
/// the total are sums over threads.
struct StepTimes {
  Scalar broad_phase = 0;  ///< finding pairs that may meet
  Scalar flight = 0;       ///< integrating bodies that nothing touches
  Scalar contacts = 0;     ///< finding contacts
  Scalar solve = 0;        ///< solving for impulses
  Scalar ends = 0;         ///< finding where contacts are at the end of a step
  Scalar proofs = 0;       ///< distance and impact queries
  Scalar total = 0;        ///< from start to end
};

struct AdvanceReport {
  AdvanceStatus status = AdvanceStatus::NotRun;
  Scalar t = 0;                      ///< World::time() on return
  std::vector<ImpactEvent> impacts;  ///< in order of time
  std::vector<BodyId> fell_asleep;
  std::vector<BodyId> woke;
  std::vector<SensorEvent> sensors;
  /// Ordered by step, then by slots. A bounce within a step gives both, begin and end; removed and
  /// disabled bodies give none.
  std::vector<ContactEvent> contact_events;
  std::vector<BrokenJoint> broken_joints;
  /// Pairs that were nearer than their target at the start of a step. They are pushed apart at a
  /// bounded speed, without a certificate until they are far enough apart. Each is listed once.
  std::vector<std::pair<BodyId, BodyId>> too_near;
  /// Pairs once too near that are now far enough apart: certified from here on.
  std::vector<std::pair<BodyId, BodyId>> parted;
  /// Bodies that the caller has put elsewhere since the last advance.
  std::vector<BodyId> placed;
  /// Pairs that no force can move apart (kinematic, static) and that came nearer than their target.
  /// Each is listed once.
  std::vector<std::pair<BodyId, BodyId>> crossed;
  std::vector<CommittedStep> steps;  ///< the proven trajectory, in order
  /// For each body in order of time; filled under WorldOptions::records_impulses.
  std::vector<VelocityChange> velocity_changes;
  /// The pair that stopped the advance, for BudgetExhausted, NumericalLimit and Blocked.
  std::pair<BodyId, BodyId> offending_pair;
  IntegratorStatistics integrator;
  ToiStatistics toi;  ///< sums over all queries
  StepStatistics work;
  StepTimes times;
};

/// Status, time and counts, on one line.
std::ostream& operator<<(std::ostream& out, const AdvanceReport& report);

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
