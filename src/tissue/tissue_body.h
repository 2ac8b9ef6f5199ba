// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/tissue/soft_tissue.h"
#include "tissue/tissue_lattice.h"

namespace dyop::tissue_internal {

struct KerfSurface;
struct NewPoint;
class LatticeCut;

/// @throws InvalidArgument if a spring has no stiffness, or a number is out of its range.
void require_valid(const JointTool& tool);

/// The rotation nearest to a matrix, from a start near to it: Newton's method on the group, with
/// the steps of [Mueller2016] where the matrix turns inside out.
Quaternion nearest_rotation(const Matrix3& f, Quaternion start);

/// The nodes that carry a point of the surface, each once, with weights that sum to one.
struct CarriedPoint {
  std::vector<std::int32_t> nodes;
  std::vector<Scalar> weights;
};

/// The state and the equations of a SoftTissue: A v' = M v + T f, with
/// A = (1 + drag T) M + (T^2 + viscosity T) K of the cubes' present rotations.
class TissueBody {
 public:
  TissueBody(const TriangleMesh& surface_W, const SoftTissueOptions& options);

  const SoftTissueOptions& options() const { return options_; }
  const TissueLattice& lattice() const { return lattice_; }
  std::span<const Vector3> vertices() const { return vertices_; }
  std::span<const TriangleIndices> triangles() const { return triangles_; }
  /// @throws InvalidArgument if there is no such triangle, or a weight is not finite.
  CarriedPoint carried_point(std::int32_t triangle, const Vector3& weights) const;
  Vector3 place(const CarriedPoint& point) const { return sum_of(point, x_); }
  static Vector3 sum_of(const CarriedPoint& point, const NodeVectors& field);
  bool is_free(std::int32_t node) const { return free_number_[std::size_t(node)] >= 0; }

  /// Returns M v + T (elastic forces + weight): the right-hand side.
  NodeVectors begin_step() const;
  /// Improves v until A v = rhs within the tolerance; returns the iterations.
  int solve(const NodeVectors& rhs, NodeVectors& v, int most) const;
  /// The factor's answer to one right-hand side: near to that of A.
  NodeVectors precondition(const NodeVectors& rhs) const;
  NodeVectors apply(const NodeVectors& v) const;
  /// Moves on with v. The impulses are what was added to the right-hand side.
  void finish_step(NodeVectors v, const NodeVectors& impulses);

  /// What was added to the right-hand side of the last step.
  const NodeVectors& last_impulses() const { return last_impulses_; }
  /// On the nodes, of forces on the surface over a step.
  /// @throws InvalidArgument as carried_point(), or if a force is not finite.
  NodeVectors impulses_of(std::span<const SurfaceForce> forces) const;
  static void add_impulse(const CarriedPoint& point, const Vector3& impulse_W, NodeVectors& sum);

  /// How all nodes at the surface answer each other, for response(). After a cut that is found for
  /// the nodes that are asked for.
  void prepare_response();
  /// The same of these nodes at the surface, which can move, where it is not yet found.
  void find_response(std::vector<std::int32_t> nodes);
  /// What an impulse on one of them does to the velocity of another within a step, from the factor:
  /// near to A^-1. That of (m, n) is the transpose, but for rounding.
  Matrix3 response(std::int32_t n, std::int32_t m) const;
  /// Adds to the velocities of nodes at the surface that can move what impulses make there: as
  /// precondition(), in less time for few nodes.
  void add_response(const NodeVectors& impulses, std::span<const std::int32_t> at, NodeVectors& v);

  const NodeVectors& velocities() const { return v_; }
  void set_velocities(const NodeVectors& v) { v_ = v; }
  const NodeVectors& positions() const { return x_; }
  void move(const RigidPose& X);
  TissueBalance balance() const;

  /// See SoftTissue::cut().
  CutReport cut(const TissueKerf& kerf);

 private:
  Vector24 corner_values(std::size_t cube, const NodeVectors& field) const;
  Vector24 strained(std::size_t cube) const;
  void number_free_nodes();
  void factorise();
  void number_surface_nodes();
  bool is_at_surface(std::int32_t node) const { return surface_number_[std::size_t(node)] >= 0; }
  friend class TissueSheets;
  NewPoint point_on(std::int32_t triangle, const Vector3& p_W) const;
  bool joins_distant(std::span<const Vector3> vertices, std::span<const TriangleIndices> triangles,
                     const std::vector<Host>& hosts) const;
  static void move_torn(const LatticeCut& cut, std::span<const Vector3> vertices,
                        std::span<const TriangleIndices> triangles,
                        const std::vector<std::int32_t>& torn, std::vector<Host>& hosts);
  Vector3 rest_place(std::int32_t triangle, const Vector3& p_W) const;
  void take(const LatticePieces& pieces);
  void take_surface(const KerfSurface& surface, LatticePieces& pieces);
  void bound_energy(Scalar most, const LatticePieces& pieces);
  bool is_tame(const BlockRows& rows) const;
  void keep_momentum(const NodeVectors& rest, NodeVectors& v) const;
  void find_rotations();
  void find_node_rotations();
  void find_forces();
  Scalar kinetic_energy(const NodeVectors& v) const;
  Scalar work_of_weight(const NodeVectors& change) const;
  NodeVectors mean_velocity(const NodeVectors& v) const;
  NodeVectors common_velocity(const NodeVectors& impulses) const;
  void place_vertices();

  SoftTissueOptions options_;
  std::vector<TriangleIndices> triangles_;
  TissueLattice lattice_;
  std::vector<std::int32_t> free_number_;  // of each node; -1: fixed
  Eigen::Index free_count_ = 0;
  std::vector<char> is_part_held_;  // of the lattice's parts: somewhere
  NestedCholesky factor_;
  NodeVectors rest_;
  NodeVectors x_;
  NodeVectors v_;
  NodeVectors forces_;  // of the strained cubes on the nodes
  Scalar elastic_energy_ = 0;
  std::vector<Quaternion> turns_;        // of the cubes
  std::vector<Matrix3> rotations_;       // the same
  std::vector<Matrix3> node_rotations_;  // smoothed
  std::vector<Vector3> vertices_;
  NodeVectors last_impulses_;
  std::vector<Eigen::Index> surface_number_;  // of each node: in the response; -1: fixed or inside
  std::vector<Eigen::Index> response_rows_;   // the factor's, of each of these
  std::vector<char> has_response_;            // the same
  Eigen::MatrixXf response_;                  // single precision: contacts are solved twice
};

}  // namespace dyop::tissue_internal
