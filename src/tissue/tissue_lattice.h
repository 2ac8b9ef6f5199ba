// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "dyop/geometry/triangle_mesh.h"
#include "dyop/tissue/soft_tissue.h"
#include "tissue/nested_cholesky.h"

namespace dyop::tissue_internal {

using Matrix24 = Eigen::Matrix<Scalar, 24, 24>;
using Vector24 = Eigen::Matrix<Scalar, 24, 1>;
using Corners = std::array<std::int32_t, 8>;

/// A cube of the lattice at rest, or the part of one inside the surface: trilinear, with Wilson's
/// incompatible modes condensed [Wilson1973], so that bending does not lock.
struct CubeElement {
  Matrix24 stiffness = Matrix24::Zero();
  /// Of the mean deformation gradient: F = sum over corners of x (its column)^T.
  Eigen::Matrix<Scalar, 3, 8> gradients = Eigen::Matrix<Scalar, 3, 8>::Zero();
  std::array<Scalar, 8> masses{};  ///< of the corners
};

/// The nodes around a vertex of the surface, with weights that sum to one.
struct Embedding {
  Corners nodes{};
  std::array<Scalar, 8> weights{};
};

/// Equal cubes that cover the inside of a closed mesh and its surface. What a cube has outside
/// counts a thousandth, so that no node is without stiffness.
class TissueLattice {
 public:
  TissueLattice(const TriangleMesh& mesh, const SoftTissueOptions& options);

  const std::vector<Cell>& cells() const { return cells_; }  ///< of the nodes
  const std::vector<Vector3>& nodes() const { return nodes_; }
  const std::vector<Scalar>& masses() const { return masses_; }  ///< of the nodes
  const std::vector<Corners>& cubes() const { return cubes_; }
  const CubeElement& element(std::size_t cube) const { return elements_[kinds_[cube]]; }
  const std::vector<Embedding>& embeddings() const { return embeddings_; }  ///< of the vertices

 private:
  std::size_t cube_index(const Cell& cell) const;
  std::size_t node_index(const Cell& cell) const;
  Cell cell_of(const Vector3& p) const;
  std::vector<Cell> covered_cells(const TriangleMesh& mesh) const;
  void add_cubes(const TriangleMesh& mesh, const SoftTissueOptions& options);
  void add_cube(const Cell& cell, std::size_t kind);
  std::int32_t add_node(const Cell& cell);
  void embed(std::span<const Vector3> vertices);
  void scale_masses(Scalar mass);

  Vector3 origin_;
  Scalar edge_;
  Cell counts_;                        // of cubes along each axis
  std::vector<std::int32_t> node_at_;  // by place; -1: none
  std::vector<std::int32_t> cube_at_;
  std::vector<Cell> cells_;
  std::vector<Vector3> nodes_;
  std::vector<Scalar> masses_;
  std::vector<Corners> cubes_;
  std::vector<std::size_t> kinds_;
  std::vector<CubeElement> elements_;
  std::vector<Embedding> embeddings_;
};

}  // namespace dyop::tissue_internal
