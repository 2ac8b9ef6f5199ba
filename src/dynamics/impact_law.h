#pragma once

#include <span>

#include "dyop/core/types.h"

namespace dyop::internal {

/// A body as an impact sees it. Immovable bodies have zero inverse mass and inertia.
struct ImpactBody {
  Scalar inverse_mass = 0;
  Matrix3 inverse_inertia_W = Matrix3::Zero();  ///< about the centre of mass, world axes
  Vector3 p_WBcm = Vector3::Zero();             ///< centre of mass
  Vector3 v_WBcm = Vector3::Zero();             ///< changed by resolve_impact()
  Vector3 w_WB = Vector3::Zero();               ///< changed by resolve_impact()
};

/// One touching place of two bodies.
struct ImpactPoint {
  std::size_t a = 0;  ///< index into the bodies
  std::size_t b = 0;
  Vector3 p_WCa = Vector3::Zero();
  Vector3 p_WCb = Vector3::Zero();
  Vector3 nhat_AB_W = Vector3::UnitX();  ///< unit, from A to B
  Scalar restitution = 0;                ///< coefficient e in [0, 1] of this point
  Scalar least_rebound = 0;              ///< normal velocity after the impact, at least; >= 0
  Scalar friction = 0;                   ///< Coulomb coefficient >= 0
  Scalar normal_velocity = 0;            ///< out: d/dt of the gap before; negative: closing
  Vector3 impulse_W = Vector3::Zero();   ///< out: on B at p_WCb; on A the opposite
};

struct ImpactOutcome {
  int iterations = 0;
  Scalar residual = 0;  ///< largest closing velocity left at any point after the impact, >= 0
};

/// Changes the velocities so that no contact closes any more: Newton's restitution along the
/// normals, Coulomb friction across them, over all points at once, by projected Gauss-Seidel
/// sweeps ([Jean1999]). docs/algorithms/stepping.md.
///
/// Guarantees v_n+ >= -residual at every point and |tangential impulse| <= friction * normal
/// impulse
/// >= 0. Unless a body on a given path pushes, the kinetic energy does not grow, but for the little
/// that least_rebound asks for.
ImpactOutcome resolve_impact(std::span<ImpactBody> bodies, std::span<ImpactPoint> points);

}  // namespace dyop::internal
