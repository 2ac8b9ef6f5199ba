// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/core/types.h"
#include "dyop/geometry/triangle_mesh.h"

namespace DYOP_EXPORT dyop {

/// An isotropic elastic material, in any consistent units. With millimetres, newtons and seconds
/// stresses are megapascals and masses tonnes: a liver has about 5e-3, 0.45 and 1.05e-9.
struct TissueMaterial {
  Scalar youngs_modulus = 0;  ///< force per area, finite, > 0
  Scalar poissons_ratio = 0;  ///< in (-1, 0.5); 0.45 suits organs
  Scalar density = 0;         ///< mass per volume, finite, > 0
  Scalar drag = 0;            ///< force per mass and velocity, 1 / time, >= 0
  /// Stress of a strain rate, relative to that of the strain (Kelvin-Voigt): a time, >= 0.
  Scalar viscosity = 0;
};

struct SoftTissueOptions {
  TissueMaterial material = {};
  /// Edge of the lattice's cubes, length, > 0. Four in a thickness bend within 3 %.
  Scalar cube_edge = 0;
  Scalar period = 0;                    ///< of a step, time, finite, > 0
  Vector3 gravity_W = Vector3::Zero();  ///< length per time squared
  /// The lattice's nodes inside one of these, in world, at rest, never move: to within a cube, the
  /// part of the tissue that lies in them.
  std::vector<AlignedBox> fixed = {};
  /// Relative error of a step's velocities, in the energy norm, > 0 and < 1.
  Scalar tolerance = 1e-2;
  int most_iterations = 12;  ///< of a solve, >= 1: it then ends with what it has
};

/// A force on a point of the surface.
struct SurfaceForce {
  std::int32_t triangle = 0;
  Vector3 weights = Vector3::Zero();  ///< of the triangle's corners, with sum one
  Vector3 force_W = Vector3::Zero();
};

/// What a body of tissue holds: sums over its nodes that can move.
struct TissueBalance {
  Scalar kinetic_energy = 0;
  Scalar elastic_energy = 0;
  Scalar potential_energy = 0;  ///< of gravity, about the world's origin
  Vector3 momentum_W = Vector3::Zero();
  Vector3 angular_momentum_W = Vector3::Zero();  ///< about the world's origin
  Scalar mass = 0;

  Scalar energy() const { return kinetic_energy + elastic_energy + potential_energy; }
};

class SoftTissue;

namespace tissue_internal {
using namespace haptics_internal;  // as in core/namespaces.h
class TissueBody;
TissueBody& body_of(SoftTissue& tissue);
}  // namespace tissue_internal

/// A body of soft tissue: a closed triangle mesh embedded in a lattice of cubes, corotational
/// linear elasticity [Mueller2004], and implicit Euler steps of a fixed period.
///
/// Each step solves one linear system, of the rotations that the cubes have when it begins, by
/// conjugate gradients; the Cholesky factor of the body at rest, turned with the nodes, is the
/// preconditioner, so nothing is factorised again. Steps are deterministic. Forces between cubes
/// and from the surface are in balance: momentum is conserved to rounding; a rigid motion strains
/// nothing.
///
/// Not modelled: contact of the tissue with itself, detail below a cube (parts of the surface
/// closer than a cube are glued), large changes of volume.
class SoftTissue {
 public:
  /// @param surface_W Closed, with positive volume, in world, at rest.
  /// @throws InvalidArgument if the mesh is not closed, the cubes would be more than a million, or
  ///         an option is out of its range; the message names the value.
  SoftTissue(const TriangleMesh& surface_W, const SoftTissueOptions& options);
  ~SoftTissue();
  SoftTissue(SoftTissue&&) noexcept;
  SoftTissue& operator=(SoftTissue&&) noexcept;

  const SoftTissueOptions& options() const;
  std::size_t cube_count() const;
  std::size_t node_count() const;

  /// One period on, under these forces, held over the step.
  /// @return Iterations of the solve; options().most_iterations: it may not have converged.
  /// @throws InvalidArgument if a triangle is out of range, or a number not finite.
  int step(std::span<const SurfaceForce> forces = {});

  std::span<const Vector3> vertices() const;  ///< of the surface, now, in world
  Vector3 velocity(std::int32_t triangle, const Vector3& weights) const;

  /// Gives all nodes that can move the velocity v + w x p, in world; p from the world's origin.
  /// @throws InvalidArgument if a number is not finite.
  void set_velocity(const Vector3& v_W, const Vector3& w_W);
  /// Moves every node to X p, and turns velocities with it: the body as it is, elsewhere. Fixed
  /// nodes stay there.
  void move(const RigidPose& X);

  TissueBalance balance() const;

 private:
  friend tissue_internal::TissueBody& tissue_internal::body_of(SoftTissue& tissue);
  std::unique_ptr<tissue_internal::TissueBody> body_;
};

}  // namespace dyop
