// SPDX-License-Identifier: BSD-3-Clause
#include "tissue/tissue_lattice.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "dyop/core/error.h"
#include "tissue/disjoint_sets.h"
#include "tissue/lattice_cut.h"

namespace dyop::tissue_internal {
namespace {

// More would not fit the memory: a node needs some kilobytes in the factor.
constexpr std::int64_t kMostCubes = 1'000'000;

Samples samples_inside(const TriangleMesh& mesh, const Vector3& corner, Scalar edge) {
  Samples inside;
  for (std::size_t k = 0; k < kSamples; ++k) {
    inside[k] = contains(mesh, corner + edge * sample_place(k));
  }
  return inside;
}

}  // namespace

TissueLattice::TissueLattice(const TriangleMesh& mesh, const SoftTissueOptions& options)
    : edge_(options.cube_edge) {
  const AlignedBox box = mesh.bounding_box();
  // literal: a size that rounding makes longer than its cubes needs no further one
  constexpr Scalar kWhole = 1 - 1e-9;
  const Vector3 counts = (kWhole * box.sizes() / edge_).array().ceil().max(1);
  DYOP_REQUIRE(counts.prod() <= Scalar(kMostCubes), "SoftTissue: cube_edge ", edge_,
               " divides the mesh's box into more than ", kMostCubes, " cubes");
  counts_ = counts.cast<int>();
  origin_ = box.center() - edge_ / 2 * counts;
  node_at_.assign(std::size_t((counts_ + Cell::Ones()).prod()), -1);
  cube_at_.assign(std::size_t(counts_.prod()), -1);
  add_cubes(mesh, options);
  embed(mesh.vertices());
  sum_masses();
  const Scalar sum = std::accumulate(masses_.begin(), masses_.end(), Scalar{0});
  mass_scale_ = mesh.compute_mass_properties(options.material.density).mass / sum;
  for (Scalar& m : masses_) m *= mass_scale_;
  find_parts();
}

std::size_t TissueLattice::cube_index(const Cell& cell) const {
  return std::size_t((cell.z() * counts_.y() + cell.y()) * counts_.x() + cell.x());
}

std::size_t TissueLattice::node_index(const Cell& cell) const {
  return std::size_t((cell.z() * (counts_.y() + 1) + cell.y()) * (counts_.x() + 1) + cell.x());
}

Cell TissueLattice::cell_of(const Vector3& p) const {
  const Vector3 place = ((p - origin_) / edge_).array().floor();
  return place.cast<int>().cwiseMax(0).cwiseMin(counts_ - Cell::Ones());
}

// Marks cubes by samples of every triangle, at most half a cube apart.
std::vector<Cell> TissueLattice::covered_cells(const TriangleMesh& mesh) const {
  std::vector<char> is_marked(cube_at_.size());
  std::vector<Cell> cells;
  for (const TriangleIndices& corners : mesh.triangles()) {
    std::array<Vector3, 3> p;
    for (std::size_t k = 0; k < 3; ++k) p[k] = mesh.vertices()[std::size_t(corners[k])];
    const Scalar longest =
        std::max({(p[1] - p[0]).norm(), (p[2] - p[1]).norm(), (p[0] - p[2]).norm()});
    const int steps = std::max(1, int(std::ceil(2 * longest / edge_)));
    for (int i = 0; i <= steps; ++i) {
      for (int k = 0; i + k <= steps; ++k) {
        const Scalar s = Scalar(i) / steps, t = Scalar(k) / steps;
        const Cell cell = cell_of((1 - s - t) * p[0] + s * p[1] + t * p[2]);
        char& mark = is_marked[cube_index(cell)];
        if (mark == 0) cells.push_back(cell);
        mark = 1;
      }
    }
  }
  return cells;
}

// Cubes that the surface crosses are examined at points; of the others the middle decides.
void TissueLattice::add_cubes(const TriangleMesh& mesh, const SoftTissueOptions& options) {
  const Matrix6 d = elasticity(options.material);
  const Scalar density = options.material.density;
  elements_.push_back(full_element(d, edge_, density));
  std::vector<char> is_crossed(cube_at_.size());
  for (const Cell& cell : covered_cells(mesh)) is_crossed[cube_index(cell)] = 1;
  Cell cell;
  for (cell.z() = 0; cell.z() < counts_.z(); ++cell.z()) {
    for (cell.y() = 0; cell.y() < counts_.y(); ++cell.y()) {
      for (cell.x() = 0; cell.x() < counts_.x(); ++cell.x()) {
        const Vector3 corner = origin_ + edge_ * cell.cast<Scalar>();
        if (is_crossed[cube_index(cell)] != 0) {
          const Samples inside = samples_inside(mesh, corner, edge_);
          if (!inside.all()) elements_.push_back(part_element(d, inside, ~inside, edge_, density));
          add_cube(cell, inside.all() ? 0 : elements_.size() - 1, inside);
        } else if (contains(mesh, corner + Vector3::Constant(edge_ / 2))) {
          add_cube(cell, 0, Samples().set());
        }
      }
    }
  }
}

void TissueLattice::add_cube(const Cell& cell, std::size_t kind, const Samples& material) {
  cube_at_[cube_index(cell)] = std::int32_t(cubes_.size());
  kinds_.push_back(kind);
  cube_cells_.push_back(cell);
  materials_.push_back(material);
  lights_.push_back(~material);
  Corners corners;
  for (std::size_t c = 0; c < 8; ++c) {
    corners[c] = add_node(cell + Cell(corner_place(c, 0), corner_place(c, 1), corner_place(c, 2)));
  }
  cubes_.push_back(corners);
}

std::int32_t TissueLattice::add_node(const Cell& cell) {
  std::int32_t& node = node_at_[node_index(cell)];
  if (node < 0) {
    node = std::int32_t(nodes_.size());
    nodes_.push_back(origin_ + edge_ * cell.cast<Scalar>());
    cells_.push_back(cell);
  }
  return node;
}

void TissueLattice::embed(std::span<const Vector3> vertices) {
  for (const Vector3& p : vertices) {
    const Cell cell = cell_of(p);
    const std::int32_t cube = cube_at_[cube_index(cell)];
    hosts_.push_back({cube, (p - origin_) / edge_ - cell.cast<Scalar>()});
  }
  embed_hosts();
}

void TissueLattice::embed_hosts() {
  embeddings_.assign(hosts_.size(), {});
  for (std::size_t k = 0; k < hosts_.size(); ++k) {
    if (hosts_[k].cube < 0) continue;
    embeddings_[k].nodes = cubes_[std::size_t(hosts_[k].cube)];
    embeddings_[k].weights = weights_at(hosts_[k].place);
  }
}

Vector3 TissueLattice::rest_place(const Host& host) const {
  return origin_ + edge_ * (cube_cells_[std::size_t(host.cube)].cast<Scalar>() + host.place);
}

void TissueLattice::sum_masses() {
  masses_.assign(nodes_.size(), 0);
  for (std::size_t k = 0; k < cubes_.size(); ++k) {
    for (std::size_t c = 0; c < 8; ++c) {
      masses_[std::size_t(cubes_[k][c])] += element(k).masses[c];
    }
  }
}

void TissueLattice::find_parts() {
  DisjointSets sets(nodes_.size());
  for (const Corners& corners : cubes_) {
    for (const std::int32_t node : corners) sets.join(std::size_t(corners[0]), std::size_t(node));
  }
  part_count_ = 0;
  parts_.clear();
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    const std::size_t lead = sets.find(n);
    parts_.push_back(lead == n ? std::int32_t(part_count_++) : parts_[lead]);
  }
}

void TissueLattice::become(const LatticePieces& pieces, const TissueMaterial& material) {
  TissueLattice old = std::move(*this);
  *this = TissueLattice(old.origin_, old.edge_, old.mass_scale_);
  for (const std::int32_t node : pieces.old_nodes) {
    nodes_.push_back(old.nodes_[std::size_t(node)]);
    cells_.push_back(old.cells_[std::size_t(node)]);
  }
  const Matrix6 d = elasticity(material);
  elements_.push_back(old.elements_[0]);
  for (const LatticePieces::Cube& cube : pieces.cubes) {
    const auto number = std::size_t(cube.old);
    const bool is_full = !cube.is_changed && old.kinds_[number] == 0;
    kinds_.push_back(is_full ? 0 : elements_.size());
    if (!is_full) {
      elements_.push_back(cube.is_changed
                              ? part_element(d, cube.material, cube.light, edge_, material.density)
                              : old.element(number));
    }
    cubes_.push_back(cube.nodes);
    cube_cells_.push_back(old.cube_cells_[number]);
    materials_.push_back(cube.material);
    lights_.push_back(cube.light);
  }
  hosts_ = pieces.hosts;
  embed_hosts();
  sum_masses();
  for (Scalar& m : masses_) m *= mass_scale_;
  find_parts();
}

void TissueLattice::soften(const std::vector<std::size_t>& cubes, Scalar factor) {
  for (const std::size_t cube : cubes) elements_[kinds_[cube]].stiffness *= factor;
}

}  // namespace dyop::tissue_internal
