// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <iosfwd>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "dyop/core/time_interval.h"
#include "dyop/distance/distance.h"
#include "dyop/dynamics/body_id.h"
#include "dyop/dynamics/integrator.h"
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

/// The start or end of an overlap between a body and a sensor.
struct SensorEvent {
  BodyId sensor;
  BodyId body;
  Scalar t = 0;             ///< when it was noticed
  bool is_overlap = false;  ///< begins (true) or ends (false)
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
  /// Of the islands, those that met another one and were stepped again with it. Their times,
  /// queries and solves above the tolerance count; their substeps, rounds and stalls do not.
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
  /// Pairs that were nearer than their target at the start of a step. They are pushed apart at a
  /// bounded speed, without a certificate until they are far enough apart. Each is listed once.
  std::vector<std::pair<BodyId, BodyId>> too_near;
  /// Pairs that no force can move apart (kinematic, static) and that came nearer than their target.
  /// Each is listed once.
  std::vector<std::pair<BodyId, BodyId>> crossed;
  std::vector<CommittedStep> steps;  ///< the proven trajectory, in order
  /// For BudgetExhausted, NumericalLimit and Blocked: the pair that stopped it.
  std::pair<BodyId, BodyId> offending_pair;
  IntegratorStatistics integrator;
  ToiStatistics toi;  ///< sums over all queries
  StepStatistics work;
  StepTimes times;
};

/// Status, time and counts, on one line.
std::ostream& operator<<(std::ostream& out, const AdvanceReport& report);

}  // namespace dyop
