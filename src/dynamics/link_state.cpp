// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/link_state.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "dyop/core/error.h"

namespace dyop::dynamics_internal {

void JointState::start_from_committed() {
  angle = angle_committed;
  impulse_W.setZero();
  angular_impulse_W.setZero();
  drive_impulse = 0;
}

void JointState::commit(Scalar h) {
  angle_committed = angle;
  force_W = impulse_W / h;
  torque_W = angular_impulse_W / h;
  drive = drive_impulse / h;
}

JointPlace joint_place(const JointDefinition& joint, const BodyRecord& a, const RigidPose& X_WA,
                       const BodyRecord& b, const RigidPose& X_WB, Scalar expected_angle) {
  JointPlace place{X_WA * joint.X_AJ, X_WB * joint.X_BJ,
                   X_WA * a.definition.mass_properties.p_BoBcm,
                   X_WB * b.definition.mass_properties.p_BoBcm, 0};
  const Matrix3& R = place.X_WJa.rotation();
  const Vector3 x = place.X_WJb.rotation().col(0);
  const Scalar angle = std::atan2(x.dot(R.col(1)), x.dot(R.col(0)));
  constexpr Scalar kTurn = 2 * std::numbers::pi;
  place.angle = angle + kTurn * std::round((expected_angle - angle) / kTurn);
  return place;
}

namespace {

using Kind = JointEquation::Kind;

// A coordinate of a joint and its rate of change by the velocities of the bodies.
struct Coordinate {
  Scalar value = 0;
  bool is_angle = false;
  Vector3 j_av_W = Vector3::Zero();
  Vector3 j_aw_W = Vector3::Zero();
  Vector3 j_bv_W = Vector3::Zero();
  Vector3 j_bw_W = Vector3::Zero();
};

Vector3 between(const JointPlace& place) {
  return place.X_WJb.translation() - place.X_WJa.translation();
}

Coordinate angle_coordinate(const JointPlace& place) {
  const Vector3 z = place.X_WJa.rotation().col(2);
  Coordinate coordinate{place.angle, true};
  coordinate.j_aw_W = -z;
  coordinate.j_bw_W = z;
  return coordinate;
}

// Lever arms to the point of A that coincides with JB, so that rows along axes of A are exact
// derivatives.
Coordinate length_along(const JointPlace& place, const Vector3& axis_W, Scalar value) {
  Coordinate coordinate{value, false};
  const Vector3 p_W = place.X_WJb.translation();
  coordinate.j_av_W = -axis_W;
  coordinate.j_aw_W = -(p_W - place.center_a_W).cross(axis_W);
  coordinate.j_bv_W = axis_W;
  coordinate.j_bw_W = (p_W - place.center_b_W).cross(axis_W);
  return coordinate;
}

Coordinate position_coordinate(const JointPlace& place) {
  const Vector3 z = place.X_WJa.rotation().col(2);
  return length_along(place, z, z.dot(between(place)));
}

Coordinate distance_coordinate(const JointPlace& place) {
  const Scalar distance = between(place).norm();
  const Vector3 axis =
      distance > 0 ? Vector3(between(place) / distance) : Vector3(place.X_WJa.rotation().col(2));
  return length_along(place, axis, distance);
}

Coordinate coupled(const JointDefinition& joint, const JointPlace& place, bool is_second) {
  if (joint.kind == JointKind::Distance) return distance_coordinate(place);
  const bool is_angle =
      joint.kind == JointKind::Hinge || (joint.kind == JointKind::Cylindrical && !is_second);
  return is_angle ? angle_coordinate(place) : position_coordinate(place);
}

// The part of a coordinate of another joint that the velocities of two bodies change. Others are
// static.
void add_part(const Coordinate& part, Scalar factor, const JointDefinition& of, BodyId a, BodyId b,
              Coordinate& sum) {
  sum.value += factor * part.value;
  const auto add = [&](BodyId id, const Vector3& j_v, const Vector3& j_w) {
    if (id == a) {
      sum.j_av_W += factor * j_v;
      sum.j_aw_W += factor * j_w;
    }
    if (id == b) {
      sum.j_bv_W += factor * j_v;
      sum.j_bw_W += factor * j_w;
    }
  };
  add(of.a, part.j_av_W, part.j_aw_W);
  add(of.b, part.j_bv_W, part.j_bw_W);
}

// Builds the rows of one joint.
class Equations {
 public:
  Equations(const JointPlace& place, Scalar radius) : place_(place), radius_(radius) {}

  Vector3 axis(Eigen::Index k) const { return place_.X_WJa.rotation().col(k); }
  Vector3 axis_b(Eigen::Index k) const { return place_.X_WJb.rotation().col(k); }
  // The rotation vector of JB relative to JA, in world axes.
  Vector3 turn() const {
    return rotation_vector(place_.X_WJb.rotation() * place_.X_WJa.rotation().transpose());
  }

  void add(const Coordinate& along, Kind kind, Scalar value, Scalar sign = 1) {
    JointEquation equation;
    const Scalar factor = sign * (along.is_angle ? radius_ : 1);
    equation.kind = kind;
    equation.value = (along.is_angle ? radius_ : 1) * value;
    equation.row.j_av_W = factor * along.j_av_W;
    equation.row.j_aw_W = factor * along.j_aw_W;
    equation.row.j_bv_W = factor * along.j_bv_W;
    equation.row.j_bw_W = factor * along.j_bw_W;
    list_.push_back(equation);
  }
  void along(const Vector3& axis_W, Scalar value) {
    add(length_along(place_, axis_W, value), Kind::Equality, value);
  }
  void about(const Vector3& axis_W, Scalar angle, Kind kind = Kind::Equality) {
    add(turning_about(axis_W), kind, angle);
  }
  void limit(const Coordinate& along, const JointLimits& limits) {
    add(along, Kind::Limit, along.value - limits.min);
    add(along, Kind::Limit, limits.max - along.value, -1);
  }
  void drive(const Coordinate& along, const JointMotor& motor) {
    const Scalar scale = along.is_angle ? radius_ : 1;
    const bool is_soft = motor.stiffness > 0 || motor.damping > 0;
    add(along, is_soft ? Kind::Drive : Kind::Motor,
        is_soft && motor.position ? along.value - *motor.position : 0);
    JointEquation& equation = list_.back();
    equation.row.target = scale * motor.speed;
    equation.row.lower = -motor.strength / scale;
    equation.row.upper = motor.strength / scale;
    equation.stiffness = motor.stiffness / (scale * scale);
    equation.damping = motor.damping / (scale * scale);
    equation.speed = scale * motor.speed;
    equation.scale = scale;
  }
  // Friction and damping.
  void resist(const Coordinate& along, const JointDefinition& joint) {
    if (joint.friction > 0) drive(along, {0, joint.friction, {}, 0, 0});
    if (joint.damping > 0) drive(along, {0, kInfinity, {}, 0, joint.damping});
  }
  void resist_turning_about(const Vector3& axis_W, const JointDefinition& joint) {
    resist(turning_about(axis_W), joint);
  }

  std::vector<JointEquation> take() {
    for (JointEquation& equation : list_) {
      equation.arm_a_W = place_.X_WJb.translation() - place_.center_a_W;
      equation.arm_b_W = place_.X_WJb.translation() - place_.center_b_W;
    }
    return std::move(list_);
  }

 private:
  static Coordinate turning_about(const Vector3& axis_W) {
    Coordinate coordinate{0, true};
    coordinate.j_aw_W = -axis_W;
    coordinate.j_bw_W = axis_W;
    return coordinate;
  }

  const JointPlace& place_;
  Scalar radius_;
  std::vector<JointEquation> list_;
};

void add_origin(Equations& equations, const JointPlace& place, Eigen::Index axes) {
  for (Eigen::Index k = 0; k < axes; ++k) {
    const Vector3 axis = equations.axis(k);
    equations.along(axis, axis.dot(between(place)));
  }
}

void add_turn(Equations& equations) {
  const Vector3 turn = equations.turn();
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Vector3 axis = equations.axis(k);
    equations.about(axis, axis.dot(turn));
  }
}

// Aligns z of JB with z of JA: two rows, valid for any angle about z.
void add_z_axis(Equations& equations) {
  const Vector3 lean = equations.axis(2).cross(equations.axis_b(2));
  for (Eigen::Index k = 0; k < 2; ++k) {
    const Vector3 axis = equations.axis(k);
    equations.about(axis, axis.dot(lean));
  }
}

// The angle about z of what turns A's z axis to B's after a twist about it changes with the
// velocity along (z_A + z_B) / (1 + z_A . z_B).
struct SwingTwist {
  Scalar swing = 0;
  Vector3 swing_axis_W = Vector3::UnitX();
  Scalar twist = 0;
  Vector3 twist_axis_W = Vector3::UnitZ();  // of length 1 / cos(swing / 2)
};

SwingTwist swing_twist_of(const JointPlace& place) {
  const Matrix3 R = place.X_WJa.rotation().transpose() * place.X_WJb.rotation();
  const Quaternion q(R);
  const Vector3 z_a = place.X_WJa.rotation().col(2);
  const Vector3 z_b = place.X_WJb.rotation().col(2);
  const Vector3 across = z_a.cross(z_b);
  SwingTwist result;
  result.swing = std::atan2(across.norm(), z_a.dot(z_b));
  result.swing_axis_W = across.norm() > 0 ? Vector3(across.normalized()) : z_a.unitOrthogonal();
  const Scalar sign = q.w() < 0 ? -1 : 1;
  result.twist = 2 * std::atan2(sign * q.z(), sign * q.w());
  constexpr Scalar kLeast = 1e-6;  // literal: keeps a joint bent right back finite
  result.twist_axis_W = (z_a + z_b) / std::max(1 + z_a.dot(z_b), kLeast);
  return result;
}

void add_swing_twist(Equations& equations, const JointPlace& place,
                     const SwingTwistLimits& limits) {
  const SwingTwist now = swing_twist_of(place);
  equations.about(-now.swing_axis_W, limits.swing - now.swing, Kind::Limit);
  if (limits.twist_max - limits.twist_min >= 2 * std::numbers::pi) return;
  equations.about(now.twist_axis_W, now.twist - limits.twist_min, Kind::Limit);
  equations.about(-now.twist_axis_W, limits.twist_max - now.twist, Kind::Limit);
}

void add_ball(Equations& equations, const JointPlace& place, const JointDefinition& joint) {
  add_origin(equations, place, 3);
  if (joint.swing_twist) add_swing_twist(equations, place, *joint.swing_twist);
  for (Eigen::Index k = 0; k < 3; ++k) equations.resist_turning_about(equations.axis(k), joint);
}

// Its third row keeps x of A and y of B at right angles: it changes with the velocity about y x x.
void add_universal(Equations& equations, const JointPlace& place, const JointDefinition& joint) {
  add_origin(equations, place, 3);
  const Vector3 x = equations.axis(0);
  const Vector3 y = equations.axis_b(1);
  equations.about(y.cross(x), x.dot(y));
  equations.resist_turning_about(x, joint);
  equations.resist_turning_about(y, joint);
}

void add_driven(Equations& equations, const Coordinate& driven, const JointDefinition& joint) {
  if (joint.motor) equations.drive(driven, *joint.motor);
  equations.resist(driven, joint);
}

void hold(Equations& equations, const Coordinate& along, const JointLimits& limits) {
  if (limits.min == limits.max) {
    equations.add(along, Kind::Equality, along.value - limits.min);
  } else {
    equations.limit(along, limits);
  }
}

std::vector<JointEquation> distance_equations(Equations& equations, const JointPlace& place,
                                              const JointDefinition& joint) {
  const Coordinate distance = distance_coordinate(place);
  if (joint.limits->min > 0) {
    hold(equations, distance, *joint.limits);
  } else {
    equations.add(distance, Kind::Limit, joint.limits->max - distance.value, -1);
  }
  std::vector<JointEquation> list = equations.take();
  for (JointEquation& equation : list) {
    equation.arm_a_W = place.X_WJa.translation() - place.center_a_W;
  }
  return list;
}

std::vector<JointEquation> coupling_equations(const JointState& joint, const JointPlaces& places,
                                              Scalar radius) {
  const JointDefinition& definition = joint.definition;
  const JointDefinition& first = joint.coupled[0]->definition;
  const JointDefinition& second = joint.coupled[1]->definition;
  const Coordinate part = coupled(first, places[0], false);
  Coordinate sum{0, part.is_angle};
  add_part(part, 1, first, definition.a, definition.b, sum);
  add_part(coupled(second, places[1], true), definition.ratio, second, definition.a, definition.b,
           sum);
  Equations equations(places[0], radius);
  hold(equations, sum, *definition.limits);
  std::vector<JointEquation> list = equations.take();
  for (JointEquation& equation : list) equation.arm_b_W.setZero();
  return list;
}

}  // namespace

std::vector<JointEquation> joint_equations(const JointState& joint, const JointPlaces& places,
                                           Scalar radius) {
  const JointDefinition& definition = joint.definition;
  const JointPlace& place = places[0];
  Equations equations(place, radius);
  switch (definition.kind) {
    case JointKind::Ball:
      add_ball(equations, place, definition);
      break;
    case JointKind::Hinge: {
      add_origin(equations, place, 3);
      add_z_axis(equations);
      const Coordinate angle = angle_coordinate(place);
      if (definition.limits) equations.limit(angle, *definition.limits);
      add_driven(equations, angle, definition);
      break;
    }
    case JointKind::Slider: {
      add_origin(equations, place, 2);
      add_turn(equations);
      const Coordinate position = position_coordinate(place);
      if (definition.limits) equations.limit(position, *definition.limits);
      add_driven(equations, position, definition);
      break;
    }
    case JointKind::Fixed:
      add_origin(equations, place, 3);
      add_turn(equations);
      break;
    case JointKind::Distance:
      return distance_equations(equations, place, definition);
    case JointKind::Universal:
      add_universal(equations, place, definition);
      break;
    case JointKind::Cylindrical:
      add_origin(equations, place, 2);
      add_z_axis(equations);
      if (definition.limits) equations.limit(position_coordinate(place), *definition.limits);
      add_driven(equations, angle_coordinate(place), definition);
      break;
    case JointKind::Coupling:
      return coupling_equations(joint, places, radius);
  }
  return equations.take();
}

Scalar coupled_coordinate(const JointDefinition& joint, const JointPlace& place, bool is_second) {
  return coupled(joint, place, is_second).value;
}

// Values.

namespace {

Scalar rate_of(const Coordinate& coordinate, const Twist& a, const Twist& b) {
  return coordinate.j_av_W.dot(a.v_WB) + coordinate.j_aw_W.dot(a.w_WB) +
         coordinate.j_bv_W.dot(b.v_WB) + coordinate.j_bw_W.dot(b.w_WB);
}

// How far apart what the joint holds together is.
Scalar separation_of(const JointDefinition& joint, const JointPlace& place) {
  const Vector3 apart = between(place);
  const Vector3 z = place.X_WJa.rotation().col(2);
  switch (joint.kind) {
    case JointKind::Slider:
    case JointKind::Cylindrical:
      return (apart - z * z.dot(apart)).norm();
    case JointKind::Distance:
      return std::max({joint.limits->min - apart.norm(), apart.norm() - joint.limits->max, 0.0});
    case JointKind::Coupling:
      return 0;
    default:
      return apart.norm();
  }
}

// About x of JA, then about y of JB.
void set_universal(const JointPlace& place, const Vector3& turn_W, JointValues& values) {
  const Matrix3 R = place.X_WJa.rotation().transpose() * place.X_WJb.rotation();
  values.angle = std::atan2(R(2, 1), R(1, 1));
  values.second_angle = std::atan2(R(0, 2), R(0, 0));
  values.angle_rate = place.X_WJa.rotation().col(0).dot(turn_W);
  values.second_rate = place.X_WJb.rotation().col(1).dot(turn_W);
}

}  // namespace

JointValues joint_values(const JointDefinition& joint, const JointPlace& place, const Twist& a,
                         const Twist& b) {
  JointValues values;
  const Vector3 turn_W = b.w_WB - a.w_WB;
  const bool turns = joint.kind == JointKind::Hinge || joint.kind == JointKind::Cylindrical;
  if (turns) {
    values.angle = place.angle;
    values.angle_rate = rate_of(angle_coordinate(place), a, b);
  }
  if (joint.kind == JointKind::Slider || joint.kind == JointKind::Cylindrical ||
      joint.kind == JointKind::Distance) {
    const Coordinate length =
        joint.kind == JointKind::Distance ? distance_coordinate(place) : position_coordinate(place);
    values.position = length.value;
    values.position_rate = rate_of(length, a, b);
  }
  if (joint.kind == JointKind::Ball) {
    const SwingTwist now = swing_twist_of(place);
    values.angle = now.twist;
    values.angle_rate = now.twist_axis_W.dot(turn_W);
    values.swing = now.swing;
  }
  if (joint.kind == JointKind::Universal) set_universal(place, turn_W, values);
  values.separation = separation_of(joint, place);
  return values;
}

// Validity.

namespace {

bool has_drive(JointKind kind) {
  return kind == JointKind::Hinge || kind == JointKind::Slider || kind == JointKind::Cylindrical;
}

void require_motor(const JointDefinition& joint) {
  const auto& name = joint.name;
  const JointMotor& motor = *joint.motor;
  const bool has_gains = motor.stiffness > 0 || motor.damping > 0;
  DYOP_REQUIRE(std::isfinite(motor.speed), "joint '", name,
               "': the motor's speed must be finite, not ", motor.speed);
  DYOP_REQUIRE(motor.strength > 0 && (has_gains || motor.strength < kInfinity), "joint '", name,
               "': the motor's strength must be > 0, and finite without gains, not ",
               motor.strength);
  DYOP_REQUIRE(motor.stiffness >= 0 && motor.stiffness < kInfinity && motor.damping >= 0 &&
                   motor.damping < kInfinity,
               "joint '", name, "': the motor's gains must be finite and >= 0, not ",
               motor.stiffness, " and ", motor.damping);
  DYOP_REQUIRE(!motor.position || std::isfinite(*motor.position), "joint '", name,
               "': the motor's position must be finite, not ", *motor.position);
  DYOP_REQUIRE(motor.position.has_value() == (motor.stiffness > 0), "joint '", name,
               "': a motor has a position with a stiffness > 0, and not without");
}

void require_limits(const JointDefinition& joint) {
  const auto& name = joint.name;
  const JointLimits& limits = *joint.limits;
  DYOP_REQUIRE(limits.min <= limits.max && std::isfinite(limits.min) && std::isfinite(limits.max),
               "joint '", name, "': limits must be finite and in order, not ", limits.min, ", ",
               limits.max);
  if (joint.kind == JointKind::Distance) {
    DYOP_REQUIRE(limits.min >= 0 && limits.max > 0, "joint '", name,
                 "': a distance must be > 0, or at least 0 and at most one > 0, not ", limits.min,
                 ", ", limits.max);
  }
}

void require_resistance(const JointDefinition& joint) {
  const auto& name = joint.name;
  const bool resists =
      has_drive(joint.kind) || joint.kind == JointKind::Ball || joint.kind == JointKind::Universal;
  const auto require_number = [&](Scalar value, const char* what) {
    DYOP_REQUIRE(value >= 0 && value < kInfinity, "joint '", name, "': ", what,
                 " must be finite and >= 0, not ", value);
    DYOP_REQUIRE(value == 0 || resists, "joint '", name,
                 "': only a joint that turns or slides can have ", what);
  };
  require_number(joint.friction, "friction");
  require_number(joint.damping, "damping");
  DYOP_REQUIRE(joint.break_force > 0 && joint.break_torque > 0, "joint '", name,
               "': the force and torque at which it breaks must be > 0, not ", joint.break_force,
               " and ", joint.break_torque);
}

}  // namespace

void require_valid(const JointDefinition& joint) {
  const auto& name = joint.name;
  const bool has_limits = has_drive(joint.kind) || joint.kind == JointKind::Distance ||
                          joint.kind == JointKind::Coupling;
  DYOP_REQUIRE(joint.a != joint.b, "joint '", name, "': needs two different bodies, not ", joint.a,
               " twice");
  DYOP_REQUIRE(!joint.motor || has_drive(joint.kind), "joint '", name,
               "': only a hinge, a slider or a cylindrical joint can have a motor");
  DYOP_REQUIRE(!joint.limits || has_limits, "joint '", name,
               "': a ball, a fixed or a universal joint cannot have limits of a coordinate");
  DYOP_REQUIRE(!joint.swing_twist || joint.kind == JointKind::Ball, "joint '", name,
               "': only a ball can have limits of swing and twist");
  if (joint.motor) require_motor(joint);
  if (joint.limits) require_limits(joint);
  require_resistance(joint);
  DYOP_REQUIRE(std::isfinite(joint.ratio) && joint.ratio != 0, "joint '", name,
               "': the ratio must be finite and not 0, not ", joint.ratio);
  if (!joint.swing_twist) return;
  const SwingTwistLimits& limits = *joint.swing_twist;
  DYOP_REQUIRE(limits.swing > 0 && limits.swing < std::numbers::pi, "joint '", name,
               "': the limit of a swing must be in (0, pi), not ", limits.swing);
  DYOP_REQUIRE(limits.twist_min <= limits.twist_max && limits.twist_min >= -std::numbers::pi &&
                   limits.twist_max <= std::numbers::pi,
               "joint '", name, "': limits of a twist must be in order and within [-pi, pi], not ",
               limits.twist_min, ", ", limits.twist_max);
}

Vector3 spring_vector(const SpringDefinition& spring, const RigidPose& X_WA,
                      const RigidPose& X_WB) {
  return X_WB * spring.p_BQ - X_WA * spring.p_AP;
}

Scalar spring_energy(const SpringState& spring, const Vector3& p_PQ_W) {
  const Scalar stretch = p_PQ_W.norm() - spring.rest_length();
  return spring.definition.stiffness * stretch * stretch / 2;
}

void require_valid(const SpringDefinition& spring) {
  const auto& name = spring.name;
  DYOP_REQUIRE(spring.a != spring.b, "spring '", name, "': it needs two bodies, not ", spring.a,
               " twice");
  DYOP_REQUIRE(spring.p_AP.allFinite() && spring.p_BQ.allFinite(), "spring '", name,
               "': its points must be finite");
  const auto require_number = [&](Scalar value, const char* what) {
    DYOP_REQUIRE(value >= 0 && value < kInfinity, "spring '", name, "': ", what,
                 " must be finite and >= 0, not ", value);
  };
  require_number(spring.stiffness, "stiffness");
  require_number(spring.damping, "damping");
  require_number(spring.rest_length.value_or(0), "rest length");
  DYOP_REQUIRE(spring.stiffness > 0 || spring.damping > 0, "spring '", name,
               "': stiffness or damping must be > 0");
}

}  // namespace dyop::dynamics_internal
