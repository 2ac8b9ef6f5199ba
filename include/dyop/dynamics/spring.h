// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <string>

#include "dyop/core/types.h"
#include "dyop/dynamics/body_id.h"

namespace DYOP_EXPORT dyop {

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
  std::string name;
  BodyId a;
  BodyId b;
  Vector3 p_AP = Vector3::Zero();     ///< in the frame of A
  Vector3 p_BQ = Vector3::Zero();     ///< in the frame of B
  std::optional<Scalar> rest_length;  ///< length >= 0; none: the current distance
  Scalar stiffness = 0;               ///< force per length, >= 0
  Scalar damping = 0;                 ///< force per speed, >= 0; not both zero
};

}  // namespace dyop
