// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "dynamics/free_flight.h"
#include "dynamics/link_state.h"
#include "dynamics/step/ledger.h"
#include "dynamics/step/track.h"
#include "dyop/contact/contact_generator.h"
#include "dyop/contact/contact_solver.h"
#include "dyop/core/types.h"
#include "dyop/dynamics/advance_report.h"
#include "dyop/dynamics/world_options.h"

namespace dyop::dynamics_internal {

/// Adds the time it lives, in seconds, to a sum, unless it is off: then it reads no clock.
class PartTimer {
 public:
  PartTimer(bool is_on, Scalar& sum) : sum_(is_on ? &sum : nullptr) {
    if (sum_) begin_ = Clock::now();
  }
  ~PartTimer() {
    if (sum_) *sum_ += std::chrono::duration<Scalar>(Clock::now() - begin_).count();
  }
  PartTimer(const PartTimer&) = delete;
  PartTimer& operator=(const PartTimer&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  Scalar* sum_;
  Clock::time_point begin_;
};

/// Awake dynamic bodies that are stepped together, and the pairs to be proven with them: between
/// two of them, or of one of them with a body that cannot be moved.
struct Island {
  std::vector<std::uint32_t> bodies;  // slots, sorted
  std::vector<PairState*> pairs;      // by key
  std::vector<JointState*> joints;    // with at least one body in `bodies`
  std::vector<SpringState*> springs;  // the same

  void clear();  // keeps its memory
};

/// Why an island could not continue.
struct IslandFailure {
  AdvanceStatus status = AdvanceStatus::NotRun;
  PairKey pair;
};

/// A proposed step of an island.
struct IslandOutcome {
  bool has_run = false;
  Scalar reached = 0;         // the step's end, unless an impact comes first or it failed
  std::vector<Track> tracks;  // by Island::bodies
  std::vector<PairProof> proofs;
  std::vector<ImpactEvent> impacts;
  std::vector<VelocityChange> changes;  // under WorldOptions::records_impulses
  std::optional<IslandFailure> failure;
  bool stopped_at_impact = false;  // the last of `impacts`
  bool in_contact = false;         // at its end
  StepStatistics work;
  StepTimes times;
  ToiStatistics toi;
  IntegratorStatistics integrator;

  /// As new, but for the memory of the tracks.
  void restart();
};

/// Runs by the bodies of their islands.
/// Adds the work that counts whether a run is kept or not.
void add_cost(AdvanceReport& report, const IslandOutcome& outcome);

using IslandRuns = std::map<std::vector<std::uint32_t>, IslandOutcome>;

/// What a step plans and finds, by island and by slot. From step to step only memory is kept.
struct StepMemory {
  std::vector<Island> islands;
  std::vector<IslandOutcome> outcomes;
  std::vector<BodyMove> moves;
  std::vector<std::uint32_t> known_moves;  // slots of those in use
  std::vector<AlignedBox> boxes;

  /// Takes out the runs of islands without a dirty body; the work of the others is added to the
  /// report as discarded.
  IslandRuns take_runs(const std::vector<bool>& is_dirty, AdvanceReport& report);
  /// One outcome for each of `count` islands, run if its bodies are those of a kept run.
  void place_runs(std::size_t count, IslandRuns kept);
};

/// Shared by all islands of a step; constant while they run.
struct StepContext {
  const WorldOptions* options = nullptr;
  Vector3 gravity_W = Vector3::Zero();
  Scalar t = 0;
  Scalar t_end = 0;
  Scalar h = 0;  // planned length of the step; t_end may come sooner
  const std::deque<BodyRecord>* bodies = nullptr;
  QueryLimits limits;

  const BodyRecord& body(std::uint32_t slot) const { return (*bodies)[slot]; }
};

/// More bodies without joints that move fast are a crowd: see SubstepProblem::is_crowd().
inline constexpr std::size_t kCrowdBodies = 20;

/// A contact of a substep, with what the scheme needs besides the solver's part.
struct SubstepContact {
  std::size_t pair = 0;              // into IslandRun::pairs()
  std::optional<std::size_t> index;  // into the pair's contacts; none: from a hit
  ContactPoint point;                // at the start of the substep
  Scalar error = 0;                  // end gap minus that of the linear prediction
  Scalar push = 0;                   // extra gap for a place that was hit again; length
  int hits = 0;
  Scalar safe_closing = 0;  // of the linear gap, known not to dip on the way; length
};

/// The large arrays of a SubstepProblem. Made anew for every substep, they would go back to the
/// system and be cleared again each time: a third of the step of a wall that stands.
struct SubstepMemory {
  ContactProblem problem;
  std::vector<SubstepContact> contacts;
};

struct StepWorkspace;
using StepWorkspaces = std::vector<std::unique_ptr<StepWorkspace>>;

/// Working memory of one thread.
struct StepWorkspace {
  ContactCascade solver;
  ToiWorkspace toi;
  ContactWorkspace contacts;
  std::vector<SubstepMemory> spare;  // what no substep uses at present
  ToiStatistics proofs;              // of the pairs proven since it was read
  StepWorkspaces helpers;            // for the pairs of one large island
};

/// Calls item(index, workspace) for all indices below `count`, so many in a row as `portion`, on up
/// to `thread_count` threads (0: one per core), each with its own workspace of `pool`. Of all
/// exceptions the one at the lowest index is rethrown, whatever the number of threads.
void run_parallel(int thread_count, std::size_t count, std::size_t portion, StepWorkspaces& pool,
                  const std::function<void(std::size_t, StepWorkspace&)>& item);

/// Steps one island from the committed states to the end of the step, in substeps: free flight
/// while nothing touches, else contact substeps (Substep), with impacts in between.
class IslandRun {
 public:
  IslandRun(const StepContext& context, const Island& island, StepWorkspace& workspace);

  IslandOutcome run();

  // For Substep and the impact law.
  struct Member {
    const BodyRecord* body = nullptr;
    CentralState state;                  // at now()
    std::shared_ptr<FreeFlight> flight;  // from now() on, or null
    // By gravity and its own wrench at the start of the step: of the centre of mass, and how much
    // faster, at most, another point becomes by turning.
    Vector3 acceleration_W = Vector3::Zero();
    Scalar turning_acceleration = 0;
  };
  struct RunPair {
    PairState* state = nullptr;
    const BodyRecord* a = nullptr;
    const BodyRecord* b = nullptr;
    std::optional<std::size_t> member_a;  // into members()
    std::optional<std::size_t> member_b;
    Scalar friction = 0;
    Scalar restitution = 0;
    Scalar acceleration = 0;               // by which forces may press them together, at most
    Scalar most_reach = 0;                 // how far its contacts are sought at most
    bool has_ball = false;                 // one of two convex shapes is a sphere
    bool is_near = false;                  // contacts of `state` are those at now()
    std::shared_ptr<const ToiResult> hit;  // that ended the substep at now(); or null
    int missed_landings = 0;  // substeps that ended at such a hit, but did not get there
  };
  const StepContext& context() const { return context_; }
  StepWorkspace& workspace() { return workspace_; }
  std::vector<Member>& members() { return members_; }
  const std::vector<Member>& members() const { return members_; }
  std::vector<RunPair>& pairs() { return pairs_; }
  IslandOutcome& outcome() { return outcome_; }
  const std::vector<JointState*>& joints() const { return island_.joints; }
  const std::vector<SpringState*>& springs() const { return island_.springs; }
  std::optional<std::size_t> member_at(BodyId id) const;
  /// The largest that gravity and wrenches give to a point of a member.
  Scalar acceleration() const { return acceleration_; }
  Scalar now() const { return now_; }
  Scalar remaining() const { return context_.t_end - now_; }

  /// Pose at now() of the frame B of either body of a pair.
  RigidPose pose_of(const std::optional<std::size_t>& member, const BodyRecord& body) const;
  /// Approaches of a pair that are faster than this bounce: faster than forces alone can cause
  /// within two steps, and than a contact solve leaves. It is lower under the policies Stop and
  /// Callback, which report every impact above it.
  Scalar restitution_speed(const RunPair& pair) const;
  /// The same between bodies in contact, where the step cannot tell an approach from what forces do
  /// in its course: a body at rest would bounce in every step.
  Scalar contact_restitution_speed(const RunPair& pair) const;
  /// How a body of a pair moves over [now(), t_end]: as `moves` (by member) say, or, outside the
  /// island, as it does by itself. The latter is put into `support`.
  const BodyMove& move_of(const std::optional<std::size_t>& member, const BodyRecord& body,
                          const std::vector<BodyMove>& moves, BodyMove& support) const;
  /// Twist of its centre of mass at now(). At the end of a substep that of a prescribed motion is
  /// the one with which the substep ends: set_next_pose() motions have a velocity jump there; the
  /// incoming velocity keeps resting bodies from being braked.
  Twist central_twist(const std::optional<std::size_t>& member, const BodyRecord& body) const;

  /// Advances to time t: appends the moves (by member) and the proofs (by pair). A certificate of a
  /// longer substep without a proof serves as far as its query is safe.
  void commit_substep(Scalar t, const std::vector<BodyMove>& moves,
                      const std::vector<Certificate>& certificates);
  /// Contacts of all near pairs at now().
  void find_contacts();
  /// Calls item(index, workspace) for all indices below `count`, on several threads if there are
  /// many. Items must be independent of each other: the results are those of one thread.
  void for_all(std::size_t count,
               const std::function<void(std::size_t, StepWorkspace&)>& item) const;
  /// Records that the members' velocities are about to change; null unless that is asked for.
  VelocityChange* begin_change(VelocityChangeKind kind, const TimeInterval& interval);
  /// They have changed.
  void end_change(VelocityChange* change) const;
  /// Adds up what for_all() has spent on proofs.
  void add_proof_costs();
  /// A timer of one part of the work; see StepTimes.
  PartTimer timer(Scalar StepTimes::*part) {
    return PartTimer(context_.options->measures_time, outcome_.times.*part);
  }
  /// The next substep is tried at most so long; see run_substep().
  Scalar longest_substep = kInfinity;
  /// Counts an infeasible substep whose room is used up; returns how many there were in this run.
  int count_infeasible() { return ++infeasible_count_; }
  /// Whether the caller wants the step to end now; it fails then.
  bool must_stop();
  /// Ends the run: no further progress is possible.
  void fail(AdvanceStatus status, PairKey pair);

 private:
  BodyMove support_move(const BodyRecord& body) const;
  void find_contacts(RunPair& pair, const std::vector<Twist>& twists, ContactWorkspace& workspace);
  bool push_apart(RunPair& pair, const RigidPose& X_WA, const RigidPose& X_WB,
                  ContactWorkspace& workspace);
  Scalar expected_approach(const RunPair& pair, Scalar travel) const;
  Scalar most_reach(const RunPair& pair) const;
  bool try_flight();
  Certificate prove_flight(RunPair& pair, const std::vector<BodyMove>& moves,
                           const TimeInterval& interval);
  void commit_flight(Scalar t, const std::vector<BodyMove>& moves,
                     const std::vector<Certificate>& certificates);
  bool will_bounce(const RunPair& pair, const ContactPoint& point, Scalar speed) const;
  bool may_fly() const;
  void stand_still();
  std::vector<BodyMove> flights_to(Scalar t_end);

  const StepContext& context_;
  const Island& island_;
  StepWorkspace& workspace_;
  std::vector<Member> members_;
  std::vector<RunPair> pairs_;
  IslandOutcome outcome_;
  Scalar now_ = 0;
  Scalar acceleration_ = 0;
  Scalar prescribed_at_ = 0;  // time at which twists of prescribed motions are taken
  int impact_count_ = 0;
  int infeasible_count_ = 0;
};

/// Normal velocity of a contact (B's point relative to A's) at the members' velocities.
Scalar normal_velocity(const IslandRun& run, const IslandRun::RunPair& pair,
                       const ContactPoint& point);

/// Solves the impact law at now() if some pair approaches faster than it may without bouncing: sets
/// new velocities of the members and records an event. Returns whether there was one.
bool resolve_impacts(IslandRun& run, bool may_bounce);

/// Whether this pair bounces at this approach speed.
bool bounces(const IslandRun& run, const IslandRun::RunPair& pair, Scalar normal_velocity);

/// The motion over an interval of a body that begins it at `state`; continues its flight, or starts
/// one. Adds the work of the integrator.
std::shared_ptr<const Motion> fly(const StepContext& context, const BodyRecord& body,
                                  const CentralState& state, const TimeInterval& interval,
                                  std::shared_ptr<FreeFlight>& flight, IntegratorStatistics& sum);

/// A bound on the way of any point of a body in a flight over an interval, if one is known already
/// for at least that time; infinite if not.
Scalar known_travel(const BodyRecord& body, const FreeFlight& flight, const TimeInterval& interval);

/// Whether an island is one body that nothing can stop or hold: free flight is all it needs.
bool is_alone(const StepContext& context, const Island& island);

/// What IslandRun does for such an island, without looking for what is not there.
void fly_alone(const StepContext& context, const Island& island, IslandOutcome& outcome);

}  // namespace dyop::dynamics_internal
