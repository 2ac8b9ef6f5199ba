// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/link_state.h"

#include <cmath>
#include <numbers>

#include "dyop/core/error.h"

namespace dyop::dynamics_internal {
namespace {

// Builds the rows of one joint.
class Equations {
 public:
  Equations(const JointDefinition& joint, const BodyRecord& a, const RigidPose& X_WA,
            const BodyRecord& b, const RigidPose& X_WB, Scalar radius)
      : X_WJa_(X_WA * joint.X_AJ), X_WJb_(X_WB * joint.X_BJ), radius_(radius) {
    const Vector3 center_a = X_WA * a.definition.mass_properties.p_BoBcm;
    const Vector3 center_b = X_WB * b.definition.mass_properties.p_BoBcm;
    between_ = X_WJb_.translation() - X_WJa_.translation();
    // Lever arm to the point of A that coincides with JB, so that rows along axes of A are exact
    // derivatives.
    arm_a_ = X_WJb_.translation() - center_a;
    arm_b_ = X_WJb_.translation() - center_b;
  }

  Vector3 axis(Eigen::Index k) const { return X_WJa_.rotation().col(k); }
  const Vector3& between() const { return between_; }
  // The rotation vector of JB relative to JA, in world axes.
  Vector3 turn() const {
    return rotation_vector(X_WJb_.rotation() * X_WJa_.rotation().transpose());
  }
  Scalar angle_about_z() const {
    const Vector3 x = X_WJb_.rotation().col(0);
    return std::atan2(x.dot(axis(1)), x.dot(axis(0)));
  }

  void along(const Vector3& axis_W, Scalar value, JointEquation::Kind kind) {
    JointEquation equation;
    equation.kind = kind;
    equation.value = value;
    equation.row.j_av_W = -axis_W;
    equation.row.j_aw_W = -arm_a_.cross(axis_W);
    equation.row.j_bv_W = axis_W;
    equation.row.j_bw_W = arm_b_.cross(axis_W);
    list_.push_back(equation);
  }
  void about(const Vector3& axis_W, Scalar angle, JointEquation::Kind kind) {
    JointEquation equation;
    equation.kind = kind;
    equation.value = radius_ * angle;
    equation.row.j_aw_W = -radius_ * axis_W;
    equation.row.j_bw_W = radius_ * axis_W;
    list_.push_back(equation);
  }
  // Speed and strength along the axis of the last row.
  void drive(Scalar speed, Scalar strength) {
    list_.back().value = 0;
    list_.back().row.target = speed;
    list_.back().row.lower = -strength;
    list_.back().row.upper = strength;
  }

  std::vector<JointEquation> take() { return std::move(list_); }

 private:
  RigidPose X_WJa_;
  RigidPose X_WJb_;
  Scalar radius_;
  Vector3 between_;
  Vector3 arm_a_;
  Vector3 arm_b_;
  std::vector<JointEquation> list_;
};

using Kind = JointEquation::Kind;

void add_origin(Equations& equations, Eigen::Index axes) {
  for (Eigen::Index k = 0; k < axes; ++k) {
    const Vector3 axis = equations.axis(k);
    equations.along(axis, axis.dot(equations.between()), Kind::Equality);
  }
}

void add_turn(Equations& equations, Eigen::Index axes) {
  const Vector3 turn = equations.turn();
  for (Eigen::Index k = 0; k < axes; ++k) {
    const Vector3 axis = equations.axis(k);
    equations.about(axis, axis.dot(turn), Kind::Equality);
  }
}

// Aligns z of JB with z of JA: two rows, valid for any angle about z.
void add_z_axis(Equations& equations, const RigidPose& X_WJb) {
  const Vector3 z = X_WJb.rotation().col(2);
  const Vector3 lean = equations.axis(2).cross(z);
  for (Eigen::Index k = 0; k < 2; ++k) {
    const Vector3 axis = equations.axis(k);
    equations.about(axis, axis.dot(lean), Kind::Equality);
  }
}

void add_hinge(const JointDefinition& joint, Equations& equations, Scalar radius) {
  const Vector3 z = equations.axis(2);
  const Scalar angle = equations.angle_about_z();
  if (joint.limits) {
    equations.about(z, angle - joint.limits->min, Kind::Limit);
    equations.about(-z, joint.limits->max - angle, Kind::Limit);
  }
  if (joint.motor) {
    equations.about(z, 0, Kind::Motor);
    equations.drive(radius * joint.motor->speed, joint.motor->strength / radius);
  }
}

void add_slider(const JointDefinition& joint, Equations& equations) {
  const Vector3 z = equations.axis(2);
  const Scalar position = z.dot(equations.between());
  if (joint.limits) {
    equations.along(z, position - joint.limits->min, Kind::Limit);
    equations.along(-z, joint.limits->max - position, Kind::Limit);
  }
  if (joint.motor) {
    equations.along(z, 0, Kind::Motor);
    equations.drive(joint.motor->speed, joint.motor->strength);
  }
}

void add_distance(const JointDefinition& joint, Equations& equations) {
  const Scalar distance = equations.between().norm();
  const Vector3 axis = distance > 0 ? Vector3(equations.between() / distance) : equations.axis(2);
  const JointLimits& limits = *joint.limits;
  if (limits.min == limits.max) {
    equations.along(axis, distance - limits.min, Kind::Equality);
  } else {
    equations.along(axis, distance - limits.min, Kind::Limit);
    equations.along(-axis, limits.max - distance, Kind::Limit);
  }
}

}  // namespace

std::vector<JointEquation> joint_equations(const JointDefinition& joint, const BodyRecord& a,
                                           const RigidPose& X_WA, const BodyRecord& b,
                                           const RigidPose& X_WB, Scalar radius) {
  Equations equations(joint, a, X_WA, b, X_WB, radius);
  switch (joint.kind) {
    case JointKind::Ball:
      add_origin(equations, 3);
      break;
    case JointKind::Hinge:
      add_origin(equations, 3);
      add_z_axis(equations, X_WB * joint.X_BJ);
      add_hinge(joint, equations, radius);
      break;
    case JointKind::Slider:
      add_origin(equations, 2);
      add_turn(equations, 3);
      add_slider(joint, equations);
      break;
    case JointKind::Fixed:
      add_origin(equations, 3);
      add_turn(equations, 3);
      break;
    case JointKind::Distance:
      add_distance(joint, equations);
      break;
  }
  return equations.take();
}

void require_valid(const JointDefinition& joint) {
  const auto& name = joint.name;
  const bool has_axis = joint.kind == JointKind::Hinge || joint.kind == JointKind::Slider;
  DYOP_REQUIRE(joint.a != joint.b, "joint '", name, "': needs two different bodies, not ", joint.a,
               " twice");
  DYOP_REQUIRE(!joint.motor || has_axis, "joint '", name,
               "': only a hinge or a slider can have a motor");
  DYOP_REQUIRE(!joint.limits || has_axis || joint.kind == JointKind::Distance, "joint '", name,
               "': only a hinge, a slider or a distance can have limits");
  if (joint.motor) {
    DYOP_REQUIRE(std::isfinite(joint.motor->speed), "joint '", name,
                 "': the motor's speed must be finite, not ", joint.motor->speed);
    DYOP_REQUIRE(joint.motor->strength > 0 && joint.motor->strength < kInfinity, "joint '", name,
                 "': the motor's strength must be finite and > 0, not ", joint.motor->strength);
  }
  if (!joint.limits) return;
  const JointLimits& limits = *joint.limits;
  DYOP_REQUIRE(limits.min <= limits.max && std::isfinite(limits.min) && std::isfinite(limits.max),
               "joint '", name, "': limits must be finite and in order, not ", limits.min, ", ",
               limits.max);
  if (joint.kind == JointKind::Hinge) {
    DYOP_REQUIRE(limits.min > -std::numbers::pi && limits.max < std::numbers::pi, "joint '", name,
                 "': limits of a hinge must be within (-pi, pi), not ", limits.min, ", ",
                 limits.max);
  }
  if (joint.kind == JointKind::Distance) {
    DYOP_REQUIRE(limits.min > 0, "joint '", name, "': a distance must be > 0, not ", limits.min);
  }
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
