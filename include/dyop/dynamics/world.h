#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <utility>
#include <vector>

#include "dyop/distance/distance.h"
#include "dyop/dynamics/integrator.h"
#include "dyop/dynamics/rigid_body.h"
#include "dyop/toi/toi_result.h"

namespace DYOP_EXPORT dyop {

/// What happens at an impact.
enum class ImpactPolicy {
  Stop,      ///< advance() returns at t_safe
  Impulse,   ///< restitution and Coulomb friction over all contacts of that instant, then go on
  Callback,  ///< the user's function changes velocities, then go on
};

/// One touching place of two bodies at an impact.
struct WorldContact {
  BodyId a = -1;
  BodyId b = -1;
  Contact contact;
  Scalar normal_velocity = 0;          ///< d/dt of the gap before the impulse; negative: closing
  Vector3 impulse_W = Vector3::Zero(); ///< on B at p_WCb; on A the opposite
};

/// Everything known about one impact of a World.
struct ImpactEvent {
  Scalar t = 0;         ///< = toi.t_safe
  BodyId a = -1;        ///< the pair that met first
  BodyId b = -1;
  ToiResult toi;
  std::vector<WorldContact> contacts;  ///< all pairs in contact at t
  bool settled = false;  ///< the Zeno guard put at least one body to rest here
};

/// The state change an ImpactPolicy::Callback asks for.
using ImpactCallback = std::function<void(const ImpactEvent& event, std::vector<MotionState>& states)>;

struct WorldOptions {
  Vector3 gravity_W = Vector3(0, 0, -9.81);
  IntegratorKind integrator = IntegratorKind::Arkode;
  IntegratorOptions integrator_options;
  Scalar margin = 0;                    ///< target distance of every pair, length; see set_margin
  std::optional<Scalar> distance_tolerance;  ///< default: 1e-6 of the smallest bounding radius
  ImpactPolicy policy = ImpactPolicy::Impulse;
  ImpactCallback on_impact;             ///< for ImpactPolicy::Callback
  std::int64_t max_node_pairs = 50'000'000;  ///< per time-of-impact query
  /// Zeno guard: a body with this many impacts within `zeno_window` is put to rest, and reported.
  int zeno_impacts = 20;
  Scalar zeno_window = 0.05;            ///< time
  Scalar zeno_speed = 0.05;             ///< contacts closing slower than this do not bounce; length per time
  int max_impacts_per_advance = 10'000;
  int threads = 0;                      ///< 0: as many as the machine has; never changes the result
};

enum class AdvanceStatus {
  NotRun,
  Completed,        ///< reached the end of the step asked for
  StoppedAtImpact,  ///< policy Stop: at t_safe of the last event
  BudgetExhausted,  ///< an engine budget ended: safe and committed up to time()
  NumericalLimit,   ///< rounding forbids distance_tolerance: safe and committed up to time()
  ImpactLimit,      ///< max_impacts_per_advance reached: safe and committed up to time()
  InitialOverlap,   ///< two bodies were within their margin at the begin: nothing was advanced
  Cancelled,        ///< the caller stopped it: safe and committed up to time()
};

/// One committed sub-step: between two of them every body follows its Motion in `motions`.
struct CommittedStep {
  TimeInterval interval;
  std::vector<std::shared_ptr<const Motion>> motions;  ///< one a body
};

struct AdvanceReport {
  AdvanceStatus status = AdvanceStatus::NotRun;
  Scalar t = 0;                        ///< World::time() at the end
  std::vector<ImpactEvent> impacts;    ///< in order
  std::vector<BodyId> settled;         ///< bodies put to rest by the Zeno guard
  std::vector<CommittedStep> steps;    ///< the proven trajectory, in order
  std::pair<BodyId, BodyId> offending_pair{-1, -1};  ///< for InitialOverlap, BudgetExhausted and NumericalLimit
  IntegratorStatistics integrator;
  ToiStatistics toi;                   ///< sums over all queries
  std::int64_t broad_phase_pairs = 0;  ///< candidate pairs handed to the engine
};

/// Rigid bodies stepped through time without ever passing through one another.
///
/// The certificate holds for the returned motion (AdvanceReport::steps), which is the library's
/// trajectory by definition; it is not an enclosure of the exact solution of the equations.
class World {
 public:
  explicit World(const WorldOptions& options = {});
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  /// @throws InvalidArgument for an incomplete or contradictory definition, naming body and field.
  BodyId add_body(const BodyDefinition& definition);

  /// Pairs are examined unless disabled; pairs of bodies that cannot move never are.
  void set_pair_enabled(BodyId a, BodyId b, bool enabled);
  /// Target distance of one pair; overrides WorldOptions::margin.
  void set_margin(BodyId a, BodyId b, Scalar margin);

  Scalar time() const;
  std::size_t body_count() const;
  const BodyDefinition& body(BodyId id) const;
  const MotionState& state(BodyId id) const;
  void set_state(BodyId id, const MotionState& state);
  bool is_settled(BodyId id) const;

  /// Total kinetic energy of the dynamic bodies, and angular momentum about the world origin.
  Scalar kinetic_energy() const;
  Vector3 angular_momentum() const;

  /// Advances by dt > 0, or less: see AdvanceStatus.
  AdvanceReport advance(Scalar dt, std::stop_token stop = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dyop
