// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <compare>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>

#include "dyop/core/rigid_pose.h"
#include "dyop/core/types.h"
#include "dyop/dynamics/rigid_body.h"

namespace DYOP_EXPORT dyop {

/// Identifies a joint of one World; never reused after the joint was removed.
struct JointId {
  std::uint64_t number = ~std::uint64_t{0};
  friend auto operator<=>(const JointId&, const JointId&) = default;
};

/// What a joint holds of its two frames JA (on A) and JB (on B).
enum class JointKind {
  Ball,         ///< origins together
  Hinge,        ///< origins and z axes together; the bodies turn about z
  Slider,       ///< axes together, origins on A's z axis; B moves along it
  Fixed,        ///< origins and axes together
  Distance,     ///< origins at a distance, or in a range of distances: a rope
  Universal,    ///< origins together, x of JA at right angles to y of JB: a cardan joint
  Cylindrical,  ///< z axes on one line; B turns about it and moves along it
  Coupling,     ///< a sum of coordinates of two other joints: gears, rack, screw, pulley
};

/// Range of a Hinge (angle of JB about z of JA, radians, turns counted), Slider or Cylindrical
/// (position of JB along z of JA, length), Distance (length, min >= 0: {0, L} is a rope of length
/// L) or Coupling (the sum).
struct JointLimits {
  Scalar min = 0;
  Scalar max = 0;
};

/// How far a Ball may turn, radians. With R the rotation of JB in JA, split into a swing, which
/// takes z of JA to z of JB the shortest way, after a twist about z.
struct SwingTwistLimits {
  Scalar swing = std::numbers::pi / 2;  ///< largest angle between the z axes, in (0, pi)
  Scalar twist_min = -std::numbers::pi;
  Scalar twist_max = std::numbers::pi;  ///< a range of a whole turn is no limit
};

/// Drives a Hinge or the angle of a Cylindrical (radians, torque), or a Slider (length, force).
///
/// Without gains it gives what it takes to have the speed, at most its strength. With gains it
/// gives stiffness (position - q) + damping (speed - q'), at most its strength: a position or
/// speed controller, part of the implicit solve, so that no gain is unstable; motions that the
/// step does not resolve decay.
struct JointMotor {
  Scalar speed = 0;
  Scalar strength = 0;  ///< largest torque or force, > 0; may be infinite with gains
  std::optional<Scalar> position = {};  ///< with stiffness; of a Hinge any number of turns
  Scalar stiffness = 0;                 ///< torque per radian or force per length, >= 0
  Scalar damping = 0;                   ///< torque or force per speed, >= 0
};

/// Two bodies held together, at least one of them Dynamic; passed to World::add_joint().
struct JointDefinition {
  std::string name = {};
  JointKind kind = JointKind::Ball;
  BodyId a = {};  ///< of a Coupling found by the World, like b: the bodies that its joints can move
  BodyId b = {};
  RigidPose X_AJ = {};                     ///< frame JA in the frame of A
  RigidPose X_BJ = {};                     ///< frame JB in the frame of B
  std::optional<JointLimits> limits = {};  ///< Distance, Coupling: none holds the initial value
  std::optional<JointMotor> motor = {};    ///< Hinge, Slider, Cylindrical
  bool bodies_collide = false;             ///< false: the pair is not examined while joined
  std::optional<SwingTwistLimits> swing_twist = {};  ///< Ball
  /// Dry friction and viscous damping, of what a motor would drive and of a Ball and a Universal
  /// about each of its axes: torque or force >= 0, and the same per speed >= 0.
  Scalar friction = 0;
  Scalar damping = 0;
  /// The joint breaks at the end of a step over which its mean reaction was larger, > 0: it is
  /// removed, see AdvanceReport::broken_joints.
  Scalar break_force = kInfinity;
  Scalar break_torque = kInfinity;
  /// Coupling: holds first's coordinate + ratio times second's. A joint's coordinate is its angle
  /// (Hinge), position (Slider) or distance (Distance); of a Cylindrical the angle as first, the
  /// position as second. Together the joints have at most two bodies that are not Static.
  JointId first = {};
  JointId second = {};
  Scalar ratio = 1;
};

/// Where a joint is, how it moves and what it bears; see World::joint_values().
struct JointValues {
  /// Angle of JB about z of JA, radians. Hinge, Cylindrical: turns are counted, from within (-pi,
  /// pi] where the joint was added. Ball: the twist. Universal: about x of JA.
  Scalar angle = 0;
  Scalar angle_rate = 0;
  Scalar second_angle = 0;  ///< Universal: about y of JB, radians
  Scalar second_rate = 0;
  Scalar swing = 0;     ///< Ball: between the z axes, radians, in [0, pi]
  Scalar position = 0;  ///< Slider, Cylindrical: along z of JA; Distance: the distance; length.
                        ///< Coupling: the sum
  Scalar position_rate = 0;
  Scalar separation = 0;  ///< between the places of JA and JB that the joint holds together, length
  /// Force and torque of the joint on B at the origin of JB (the opposite acts on A there), motor,
  /// friction and limits included: the mean over the last step in which the bodies were awake;
  /// world axes. For a Coupling, those on b about its centre of mass.
  Vector3 force_W = Vector3::Zero();
  Vector3 torque_W = Vector3::Zero();
  /// The part that motor, friction and damping gave along the coordinate that the motor
  /// drives: torque or force.
  Scalar drive = 0;
};

/// Names a spring of one World; never used again after the spring was removed.
struct SpringId {
  std::uint64_t number = ~std::uint64_t{0};
  friend auto operator<=>(const SpringId&, const SpringId&) = default;
};

/// A spring and damper between a point P of A and a point Q of B, at least one of the two bodies
/// Dynamic; handed to World::add_spring(). With d = |Q - P| the force along the line from P to Q is
/// stiffness (d - rest_length) + damping d', pulling the points together if positive. With a rest
/// length of zero it is stiffness (Q - P) + damping (Q - P)' in all directions.
///
/// Solved together with contacts by the implicit midpoint rule, of second order in the step h: a
/// frequency w comes out too low by a fraction (w h)^2 / 12, and without damping energy is
/// conserved. Motions that the step does not resolve, w h > 2 or overdamped within it, decay; no
/// stiffness is unstable.
struct SpringDefinition {
  std::string name = {};
  BodyId a = {};
  BodyId b = {};
  Vector3 p_AP = Vector3::Zero();          ///< in the frame of A
  Vector3 p_BQ = Vector3::Zero();          ///< in the frame of B
  std::optional<Scalar> rest_length = {};  ///< length >= 0; none: the current distance
  Scalar stiffness = 0;                    ///< force per length, >= 0
  Scalar damping = 0;                      ///< force per speed, >= 0; not both zero
};

}  // namespace dyop
