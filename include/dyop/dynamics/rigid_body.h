// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <any>
#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <ostream>
#include <string>

#include "dyop/core/export.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/shape.h"
#include "dyop/motion/motion.h"

namespace DYOP_EXPORT dyop {

/// Identifies a body of one World. A slot is reused after its body was removed, with a new
/// generation: an id that outlived its body is refused, never mistaken for a newer body.
struct BodyId {
  std::uint32_t slot = ~std::uint32_t{0};
  std::uint32_t generation = 0;

  BodyId() = default;  ///< refers to no body
  constexpr explicit BodyId(std::size_t the_slot, std::uint32_t the_generation = 0)
      : slot(static_cast<std::uint32_t>(the_slot)), generation(the_generation) {}

  friend auto operator<=>(const BodyId&, const BodyId&) = default;
  friend std::ostream& operator<<(std::ostream& out, const BodyId& id) {
    out << id.slot;
    if (id.generation > 0) out << '.' << id.generation;
    return out;
  }
};

}  // namespace dyop

template <>
struct std::hash<dyop::BodyId> {
  std::size_t operator()(const dyop::BodyId& id) const noexcept {
    return std::hash<std::uint64_t>{}(std::uint64_t{id.generation} << 32 | id.slot);
  }
};

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

/// A wrench as a smooth function of time and the body's own state. Called many times per step, also
/// for states that are not committed; must have no side effects.
using WrenchCallback = std::function<Wrench(Scalar t, const MotionState& state)>;

/// Locked degrees of freedom: the centre of mass does not move along, and the body does not turn
/// about, the world axes marked here. Locked velocities stay zero.
struct LockedAxes {
  std::array<bool, 3> translation{false, false, false};
  std::array<bool, 3> rotation{false, false, false};

  bool any_rotation() const { return rotation[0] || rotation[1] || rotation[2]; }
  bool any() const { return translation[0] || translation[1] || translation[2] || any_rotation(); }
};

/// Which pairs of bodies are examined. Two bodies of one group collide always (group > 0) or never
/// (group < 0); others if the category of each is in the mask of the other.
struct CollisionFilter {
  std::uint64_t category = 1;              ///< bit set: what the body is
  std::uint64_t mask = ~std::uint64_t{0};  ///< bit set: what it collides with
  std::int32_t group = 0;                  ///< 0: none

  friend bool operator==(const CollisionFilter&, const CollisionFilter&) = default;
  bool accepts(const CollisionFilter& other) const {
    if (group != 0 && group == other.group) return group > 0;
    return (category & other.mask) != 0 && (other.category & mask) != 0;
  }
};

/// Friction and restitution; see BodyDefinition.
struct Material {
  Scalar restitution = 0.5;
  Scalar friction = 0.5;
  Scalar rolling_friction = 0;
  Scalar torsional_friction = 0;

  friend bool operator==(const Material&, const Material&) = default;
};

/// Everything that defines a body; passed to World::add_body().
struct BodyDefinition {
  std::string name = {};
  BodyKind kind = BodyKind::Dynamic;
  std::shared_ptr<const Shape> shape = {};
  /// Dynamic and Static (which ignores the twist): pose of the shape's frame B, twist of its
  /// origin.
  MotionState initial = {};
  MassProperties mass_properties = {};        ///< Dynamic
  std::shared_ptr<const Motion> motion = {};  ///< Kinematic
  WrenchCallback wrench = {};                 ///< Dynamic, optional
  LockedAxes locked = {};                     ///< Dynamic
  /// How the coefficients of a pair combine is WorldOptions' to say; World::set_pair_material()
  /// replaces them.
  Scalar restitution = 0.5;       ///< coefficient in [0, 1]; usually a pair uses the smaller
  Scalar friction = 0.5;          ///< Coulomb coefficient >= 0; usually the geometric mean
  Scalar rolling_friction = 0;    ///< length >= 0; a pair uses the larger
  Scalar torsional_friction = 0;  ///< length >= 0; a pair uses the larger
  CollisionFilter filter = {};
  /// A sensor exerts and feels no contact force: World reports when bodies overlap it. A dynamic
  /// one falls through what it meets; a fixed joint carries it along with a body.
  bool is_sensor = false;
  std::any user_data = {};  ///< kept, never read
};

}  // namespace dyop
