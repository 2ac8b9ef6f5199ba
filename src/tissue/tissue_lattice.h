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
#include "tissue/cube_element.h"
#include "tissue/nested_cholesky.h"

namespace dyop::tissue_internal {

using Corners = std::array<std::int32_t, 8>;
using NodeVectors = Eigen::Matrix<Scalar, 3, Eigen::Dynamic>;

/// The nodes around a vertex of the surface, with weights that sum to one.
struct Embedding {
  Corners nodes{};
  std::array<Scalar, 8> weights{};
};

/// A place in a cube at rest, the cube's edge as unit.
struct Host {
  std::int32_t cube = -1;  ///< -1: of a vertex that no triangle uses
  Vector3 place = Vector3::Zero();
};

struct LatticePieces;

/// Equal cubes that cover the inside of a closed mesh and its surface. What a cube has outside
/// counts a thousandth, so that no node is without stiffness. After a cut several cubes may be at
/// one place, each with its part of the material there.
class TissueLattice {
 public:
  TissueLattice(const TriangleMesh& mesh, const SoftTissueOptions& options);

  const std::vector<Cell>& cells() const { return cells_; }  ///< of the nodes
  const std::vector<Vector3>& nodes() const { return nodes_; }
  const std::vector<Scalar>& masses() const { return masses_; }  ///< of the nodes
  const std::vector<Corners>& cubes() const { return cubes_; }
  const CubeElement& element(std::size_t cube) const { return elements_[kinds_[cube]]; }
  const std::vector<Embedding>& embeddings() const { return embeddings_; }  ///< of the vertices

  Scalar edge() const { return edge_; }
  const std::vector<Host>& hosts() const { return hosts_; }  ///< of the vertices
  Vector3 rest_place(const Host& host) const;
  const Cell& cube_cell(std::size_t cube) const { return cube_cells_[cube]; }
  /// The samples that are inside the surface, and those that have a thousandth of the mass.
  const Samples& material(std::size_t cube) const { return materials_[cube]; }
  const Samples& light(std::size_t cube) const { return lights_[cube]; }
  /// Cubes that share nodes are of one part; numbered from 0.
  std::int32_t part_of_cube(std::size_t cube) const { return part_of_node(cubes_[cube][0]); }
  std::int32_t part_of_node(std::int32_t node) const { return parts_[std::size_t(node)]; }
  std::size_t part_count() const { return part_count_; }

  /// What a cut has left: the changed cubes are integrated anew.
  void become(const LatticePieces& pieces, const TissueMaterial& material);
  /// Scales the stiffness of cubes.
  void soften(const std::vector<std::size_t>& cubes, Scalar factor);

 private:
  TissueLattice(const Vector3& origin, Scalar edge, Scalar mass_scale)
      : origin_(origin), edge_(edge), counts_(Cell::Zero()), mass_scale_(mass_scale) {}
  std::size_t cube_index(const Cell& cell) const;
  std::size_t node_index(const Cell& cell) const;
  Cell cell_of(const Vector3& p) const;
  std::vector<Cell> covered_cells(const TriangleMesh& mesh) const;
  void add_cubes(const TriangleMesh& mesh, const SoftTissueOptions& options);
  void add_cube(const Cell& cell, std::size_t kind, const Samples& material);
  std::int32_t add_node(const Cell& cell);
  void embed(std::span<const Vector3> vertices);
  void embed_hosts();
  void sum_masses();
  void find_parts();

  Vector3 origin_;
  Scalar edge_;
  Cell counts_;                        // of cubes along each axis
  std::vector<std::int32_t> node_at_;  // by place; -1: none
  std::vector<std::int32_t> cube_at_;
  std::vector<Cell> cells_;
  std::vector<Vector3> nodes_;
  std::vector<Scalar> masses_;
  std::vector<Corners> cubes_;
  std::vector<Cell> cube_cells_;
  std::vector<Samples> materials_, lights_;
  std::vector<std::size_t> kinds_;
  std::vector<CubeElement> elements_;
  std::vector<Host> hosts_;
  std::vector<Embedding> embeddings_;
  Scalar mass_scale_ = 1;            // so that the cubes' masses sum to the mesh's
  std::vector<std::int32_t> parts_;  // of the nodes
  std::size_t part_count_ = 0;
};

}  // namespace dyop::tissue_internal
