#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/mass_properties.h"
#include "dyop/geometry/shape.h"
#include "dyop/motion/motion.h"

namespace DYOP_EXPORT dyop {

enum class BodyKind {
  Dynamic,    ///< moved by forces and impulses
  Kinematic,  ///< moved by a given Motion
  Static,     ///< never moves
};

/// Force through, and torque about, the centre of mass, world axes.
struct Wrench {
  Vector3 force = Vector3::Zero();
  Vector3 torque = Vector3::Zero();
};

/// A wrench as a smooth function of time and the body's own state. Called many times a step, also
/// for states that are not committed; must have no side effects.
using WrenchCallback = std::function<Wrench(Scalar t, const MotionState& state)>;

/// What a body is made of; handed to World::add_body().
struct BodyDefinition {
  std::string name;
  BodyKind kind = BodyKind::Dynamic;
  std::shared_ptr<const Shape> shape;
  MotionState initial;                      ///< Dynamic and Static (twist ignored for Static)
  MassProperties mass_properties;         ///< Dynamic
  std::shared_ptr<const Motion> motion;   ///< Kinematic
  WrenchCallback wrench;                  ///< Dynamic, optional
  Scalar restitution = 0.5;               ///< coefficient in [0, 1]; a pair uses the smaller
  Scalar friction = 0.5;                  ///< Coulomb coefficient >= 0; a pair uses the geometric mean
};

/// Number of a body in its World, in the order of addition.
using BodyId = std::int32_t;

}  // namespace dyop
