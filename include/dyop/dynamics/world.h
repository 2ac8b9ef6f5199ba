// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <any>
#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <stop_token>
#include <utility>
#include <vector>

#include "dyop/dynamics/advance_report.h"
#include "dyop/dynamics/joint.h"
#include "dyop/dynamics/rigid_body.h"
#include "dyop/dynamics/world_options.h"
#include "dyop/dynamics/world_query.h"
#include "dyop/toi/time_of_impact.h"

namespace DYOP_EXPORT dyop {

/// A World's state at one time; see World::snapshot().
class WorldSnapshot {
 public:
  struct State;

 private:
  friend class World;
  std::shared_ptr<const State> state_;
};

/// When advance() must return early.
struct AdvanceLimits {
  std::stop_token stop = {};
  /// Checked between the parts of a step and within its queries; a contact solve that has started
  /// is finished. An interrupted step is shortened to the time proven so far, which may be zero: a
  /// step that never fits needs a later deadline or a smaller WorldOptions::max_step.
  std::optional<std::chrono::steady_clock::time_point> deadline = {};
  std::int64_t max_steps = std::numeric_limits<std::int64_t>::max();  ///< committed steps, > 0
};

/// Rigid bodies stepped through time without ever passing through one another
/// (docs/algorithms/stepping.md).
///
/// Promise: over every committed step (AdvanceReport::steps) every enabled pair of bodies, at least
/// one of them Dynamic, keeps its target distance, except pairs reported as too near. The
/// certificate holds for the returned motion, which is by definition the library's trajectory; it
/// does not enclose the exact solution of the equations.
///
/// Deterministic: the same calls give the same bits, for any number of threads. Not for concurrent
/// use.
class World {
 public:
  explicit World(const WorldOptions& options = {});
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  /// @throws InvalidArgument for an incomplete or contradictory definition, naming body and field.
  BodyId add_body(const BodyDefinition& definition);
  /// Wakes bodies that rested on it.
  void remove_body(BodyId id);

  /// A disabled body stays where it is; nothing collides with it.
  void set_enabled(BodyId id, bool is_enabled);
  /// Replaces the motion of a kinematic body from now on. It must start at the body's current pose.
  /// @throws InvalidArgument if it starts elsewhere, by more than a thousandth of the body's
  /// radius.
  void set_motion(BodyId id, std::shared_ptr<const Motion> motion);
  /// The same for a body whose future is known one pose at a time (a hand, a log that is being
  /// written): it moves to X_WB until the time t > time(), its origin along a line and turning at a
  /// constant rate, then rests there (the motion ends after 1e9 move times).
  void set_next_pose(BodyId id, const RigidPose& X_WB, Scalar t);
  /// Puts a dynamic body elsewhere and wakes it. Pairs that this brings too near are reported.
  void set_state(BodyId id, const MotionState& state);
  /// Gives a dynamic body a force of its own and wakes it. An empty function removes the force.
  void set_wrench(BodyId id, WrenchCallback wrench);
  /// Sets friction and restitution from now on; wakes what the body touches.
  void set_material(BodyId id, const Material& material);
  /// Sets the material of one pair, in place of the one that follows from its bodies; nullopt
  /// undoes that. Wakes both.
  void set_pair_material(BodyId a, BodyId b, const std::optional<Material>& material);
  /// The material of a pair: the one set for it, or the combined one of its bodies.
  Material pair_material(BodyId a, BodyId b) const;
  /// Gives a dynamic body another mass and wakes it. Keeps pose, v of its origin and w: the
  /// momentum changes.
  /// @throws InvalidArgument as add_body().
  void set_mass_properties(BodyId id, const MassProperties& mass_properties);
  /// Gives a body another shape in the same frame; wakes it and what it touched. The mass stays.
  /// Pairs that it brings too near are reported.
  void set_shape(BodyId id, std::shared_ptr<const Shape> shape);
  /// Which pairs of a body are examined from now on; wakes what it touched.
  void set_filter(BodyId id, const CollisionFilter& filter);
  /// Changes a dynamic body's momentum at once, force times time, through the point p_W or its
  /// centre of mass, and its angular momentum about its centre of mass; wakes it. Locked axes stay.
  void apply_impulse(BodyId id, const Vector3& impulse_W, const Vector3& p_W);
  void apply_impulse(BodyId id, const Vector3& impulse_W);
  void apply_angular_impulse(BodyId id, const Vector3& angular_impulse_W);
  void set_gravity(const Vector3& gravity_W);
  void wake(BodyId id);

  /// Holds two bodies together from now on. An initial offset of the frames is closed at bounded
  /// speed.
  /// @throws InvalidArgument naming the joint and what is wrong.
  JointId add_joint(const JointDefinition& definition);
  /// With it go couplings of its coordinates.
  void remove_joint(JointId id);
  /// A new motor, or none; wakes the joint's bodies.
  void set_motor(JointId id, const std::optional<JointMotor>& motor);
  const JointDefinition& joint(JointId id) const;
  /// Angle, position and rates at time(), and what it bore in the last step.
  JointValues joint_values(JointId id) const;

  /// Acts between two bodies from now on.
  /// @throws InvalidArgument naming the spring and what is wrong.
  SpringId add_spring(const SpringDefinition& definition);
  void remove_spring(SpringId id);
  const SpringDefinition& spring(SpringId id) const;
  /// Energy stored in all springs now.
  Scalar spring_energy() const;

  /// Pairs are examined as their filters say unless one is enabled or disabled here; joined ones,
  /// and those of bodies that cannot move, never are.
  void set_pair_enabled(BodyId a, BodyId b, bool is_enabled);
  /// Target distance of one pair; overrides WorldOptions::target_distance.
  void set_target_distance(BodyId a, BodyId b, Scalar target_distance);

  /// A pair that set_pair_enabled(), set_target_distance() or set_pair_material() named, or that a
  /// filter leaves out.
  struct PairRule {
    BodyId a;
    BodyId b;
    bool is_enabled = true;
    std::optional<Scalar> target_distance;  ///< none: as for all pairs
    std::optional<Material> material;       ///< none: combined
  };
  std::vector<PairRule> pair_rules() const;
  /// The options that the World was made with.
  const WorldOptions& options() const;
  Vector3 gravity() const;
  std::vector<JointId> joints() const;
  std::vector<SpringId> springs() const;
  /// Grows with every change of gravity, joints, springs and what pair_rules() tells.
  std::uint64_t rules_version() const;

  Scalar time() const;
  std::size_t body_count() const;
  /// All bodies, by slot.
  std::vector<BodyId> bodies() const;
  bool has_body(BodyId id) const;
  const BodyDefinition& body(BodyId id) const;
  std::any& user_data(BodyId id);
  /// Pose and twist of the frame B at time().
  MotionState state(BodyId id) const;
  bool is_asleep(BodyId id) const;
  bool is_enabled(BodyId id) const;

  /// Records of all near pairs after the last step, ordered by slots; see PairRecord.
  std::vector<PairRecord> pairs() const;
  /// The pairs() that are in contact.
  std::vector<PairRecord> contacts() const;

  /// Returns what a ray meets first among the bodies as they stand at time(). Closed meshes count
  /// as solids, here and in the other queries. The first query after a step or change costs a look
  /// at every body.
  /// @param direction_W Of any length.
  /// @throws InvalidArgument unless origin, direction and length are finite, the direction not 0
  ///         and the length > 0.
  BodyRayHit cast_ray(const Vector3& origin_W, const Vector3& direction_W, Scalar length,
                      const BodyFilter& filter = {}) const;
  /// Returns what a shape on a motion meets first among them.
  /// @throws InvalidArgument as ObstacleSet::first_impact().
  ShapeHit cast_shape(const Shape& shape, const Motion& motion, const TimeInterval& interval,
                      const ToiOptions& options = {}, const BodyFilter& filter = {}) const;
  /// Returns the body nearest to a shape.
  /// @throws InvalidArgument as ObstacleSet::nearest().
  NearestBody nearest(const Shape& shape, const RigidPose& X_WS,
                      const DistanceOptions& options = {}, const BodyFilter& filter = {}) const;
  /// Returns all bodies at most `max_distance` from a shape; 0: those that it overlaps or touches.
  /// @throws InvalidArgument unless the distance is finite and >= 0.
  BodyOverlaps overlaps(const Shape& shape, const RigidPose& X_WS, Scalar max_distance = 0,
                        const BodyFilter& filter = {}) const;

  /// Total kinetic energy of the dynamic bodies, their momentum, and angular momentum about the
  /// world origin.
  Scalar kinetic_energy() const;
  Vector3 momentum() const;
  Vector3 angular_momentum() const;

  /// Advances by dt > 0, or less: see AdvanceStatus. To cover the rest, call it again.
  /// @throws InvalidArgument if a kinematic body's motion is not defined until then,
  ///         IntegrationError if a wrench is not finite or cannot be integrated; both name the
  ///         body. The World is then at the last committed step.
  AdvanceReport advance(Scalar dt, const AdvanceLimits& limits = {});

  /// Everything that determines what the World will do. Taking a snapshot restarts the integrators,
  /// as restore() does: the run continues with the same bits as one restored from it.
  WorldSnapshot snapshot();
  /// @throws InvalidArgument unless the snapshot is of this World (or of one it was moved from).
  void restore(const WorldSnapshot& snapshot);

  struct Impl;  ///< of the library

 private:
  void forget_pair(BodyId a, BodyId b);
  void rouse(BodyId a, BodyId b);

  std::unique_ptr<Impl> impl_;
};

}  // namespace dyop
