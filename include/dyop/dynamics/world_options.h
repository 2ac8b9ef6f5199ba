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

/// What to do at an impact: a hit of two bodies that were not in contact.
enum class ImpactPolicy {
  Stop,      ///< advance() returns at t_safe of the first impact
  Impulse,   ///< restitution and Coulomb friction at all contacts of that instant, then go on
  Callback,  ///< the user's function changes velocities, then go on
};

/// The states that ImpactPolicy::Callback may change: those of event.a and event.b. Changes to
/// dynamic bodies are adopted; a pair left as it is touches without bouncing.
struct ImpactStates {
  MotionState a;
  MotionState b;
};
using ImpactCallback = std::function<void(const ImpactEvent& event, ImpactStates& states)>;

/// How a coefficient of a pair follows from those of its bodies.
enum class CombineRule { GeometricMean, Mean, Product, Minimum, Maximum };

/// Lengths are per pair; those not given are fractions of the smaller size r of its two shapes, so
/// that no unit is assumed. The size is the bounding radius, but at most half the diagonal of the
/// bounding box: a shape far from its frame's origin is no larger for it.
struct WorldOptions {
  Vector3 gravity_W = Vector3::Zero();
  /// For bodies in free flight with their own wrench. The others need no integrator: they fall
  /// along a parabola and turn by the Taylor series of their equations, to the same relative
  /// tolerance.
  IntegratorKind integrator = IntegratorKind::Arkode;
  IntegratorOptions integrator_options = {};
  /// Longest step h, time: advance() divides longer spans into equal parts. Default: one step.
  /// Contact is solved once per step; free flight is adaptive within it.
  std::optional<Scalar> max_step = {};
  /// d*, the distance that is proven to be kept, length >= 0. Default: 1e-4 r. See
  /// World::set_target_distance.
  std::optional<Scalar> target_distance = {};
  /// s, how far above d* bodies come to rest, length > 0. Default: 4 d*, or 4e-4 r if d* is 0.
  /// Less where a body has too little room for it (docs/algorithms/stepping.md, "Close fits").
  std::optional<Scalar> rest_offset = {};
  ImpactPolicy policy = ImpactPolicy::Impulse;
  ImpactCallback on_impact = {};  ///< for ImpactPolicy::Callback
  /// Slower approaches do not bounce, length per time. Default, for each pair: 2 h times the
  /// acceleration of gravity, or the relative one by gravity and wrenches if that is larger; at
  /// least the tolerance of a contact solve; unless the policy is Impulse at most sqrt(r g) / 10:
  /// no long step hides an impact. Whatever is given, bounces end that are lower than a landing is
  /// exact, and between bodies in contact those slower than what forces do in a step.
  std::optional<Scalar> restitution_speed = {};
  /// A body that moves slower than this may fall asleep, length per time. Default: a hundredth of
  /// the rest offset per step; steps shorter than the time to fall that far are pooled.
  std::optional<Scalar> sleep_speed = {};
  /// An island falls asleep after this many slow steps, and at once if it is slow and impulses at
  /// its contacts are found that balance gravity within the friction cones. 0: never.
  int sleep_steps = 50;
  /// Largest speed at which bodies that start too near are pushed apart, length per time. Default:
  /// r/20 per step.
  std::optional<Scalar> separation_speed = {};
  /// How the coefficients of friction and of restitution of a pair follow from those of its two
  /// bodies. Bullet multiplies both.
  CombineRule combine_friction = CombineRule::GeometricMean;
  CombineRule combine_restitution = CombineRule::Minimum;
  /// Coefficient of friction of a pair at a contact that slides with a velocity (B's point
  /// relative to A's, world axes, length per time): finite, >= 0, deterministic, callable from
  /// several threads, best continuous. Default: that of the pair's material.
  std::function<Scalar(BodyId a, BodyId b, const Vector3& sliding_W)> friction_law = {};
  ContactSolverOptions solver = {};  ///< tolerance is ignored: derived from rest offset and step
  std::int64_t max_node_pairs = 50'000'000;  ///< per time-of-impact query
  bool records_motions = true;               ///< fills AdvanceReport::steps
  bool records_impulses = false;             ///< fills AdvanceReport::velocity_changes
  bool measures_time = false;                ///< fills AdvanceReport::times; reads the clock
  /// Called after each committed step; must not change the World.
  std::function<void(Scalar t)> on_step = {};
  int thread_count = 0;  ///< 0: one per core; never changes the result
};

}  // namespace dyop
