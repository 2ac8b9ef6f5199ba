// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "dyop/contact/contact_solver.h"
#include "dyop/dynamics/advance_report.h"
#include "dyop/dynamics/integrator.h"
#include "dyop/dynamics/rigid_body.h"

namespace DYOP_EXPORT dyop {

/// What happens at an impact: a hit of two bodies that were not in contact.
enum class ImpactPolicy {
  Stop,      ///< advance() returns at t_safe of the first impact
  Impulse,   ///< restitution and Coulomb friction over all contacts of that instant, then go on
  Callback,  ///< the user's function changes velocities, then go on
};

/// A change of state that ImpactPolicy::Callback asks for: `states` are those of event.a and
/// event.b; what it writes for dynamic bodies is taken over.
struct ImpactStates {
  MotionState a;
  MotionState b;
};
using ImpactCallback = std::function<void(const ImpactEvent& event, ImpactStates& states)>;

/// Lengths are per pair and, where not given, parts of the smaller bounding radius r of the pair,
/// so that no unit is assumed.
struct WorldOptions {
  Vector3 gravity_W = Vector3::Zero();
  IntegratorKind integrator = IntegratorKind::Arkode;
  IntegratorOptions integrator_options;
  /// Longest step h, time: advance() divides longer spans into equal parts. None: one step.
  /// Contact is solved once per step, free flight is adaptive inside it.
  std::optional<Scalar> max_step;
  /// d*, the distance that is proven to be kept, length >= 0. Default: 1e-4 r. See
  /// World::set_target_distance.
  std::optional<Scalar> target_distance;
  /// s, how far above d* bodies come to rest, length > 0. Default: 4 d*, or 4e-4 r if d* is 0.
  std::optional<Scalar> standoff;
  ImpactPolicy policy = ImpactPolicy::Impulse;
  ImpactCallback on_impact;  ///< for ImpactPolicy::Callback
  /// Approach speeds below it do not bounce, length per time. Default: 2 h times the acceleration
  /// of gravity.
  std::optional<Scalar> restitution_speed;
  /// A body is slow while it moves less than this, length per time. Default: what covers a
  /// hundredth of the standoff in a step.
  std::optional<Scalar> sleep_speed;
  int sleep_steps = 50;  ///< an island falls asleep after so many slow steps; 0: never
  /// How fast bodies that began too near are pushed apart at most, length per time. Default: r/20
  /// per step.
  std::optional<Scalar> separation_speed;
  ContactSolverOptions solver;  ///< its tolerance is derived from the standoff and the step
  std::int64_t max_node_pairs = 50'000'000;  ///< per time-of-impact query
  bool records_motions = true;               ///< fills AdvanceReport::steps
  bool measures_time = false;                ///< fills AdvanceReport::times; reads the clock
  /// Called after each committed step; must not change the World.
  std::function<void(Scalar t)> on_step;
  int thread_count = 0;  ///< 0: as many as the machine has; never changes the result
};

}  // namespace dyop
