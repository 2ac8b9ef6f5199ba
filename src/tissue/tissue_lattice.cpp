// SPDX-License-Identifier: BSD-3-Clause
#include "tissue/tissue_lattice.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <bitset>
#include <cmath>

#include "dyop/core/error.h"

namespace dyop::tissue_internal {
namespace {

// Of what lies outside the surface, relative to the material.
constexpr Scalar kOutside = 1e-3;
// Points at which a cube that the surface crosses is examined: a rank-1 lattice, whose projection
// on each axis has all of them, evenly spread, so faces along the axes are placed to 1 %.
constexpr int kPoints = 101;
constexpr std::array<int, 3> kGenerator{1, 40, 85};  // 40^2 = 85 modulo 101
// More would not fit the memory: a node needs some kilobytes in the factor.
constexpr std::int64_t kMostCubes = 1'000'000;

using Matrix6 = Eigen::Matrix<Scalar, 6, 6>;
using Matrix9 = Eigen::Matrix<Scalar, 9, 9>;
using Matrix6x24 = Eigen::Matrix<Scalar, 6, 24>;
using Matrix6x9 = Eigen::Matrix<Scalar, 6, 9>;
using Gradients = Eigen::Matrix<Scalar, 3, 8>;

Matrix6 elasticity(const TissueMaterial& material) {
  const Scalar nu = material.poissons_ratio;
  const Scalar mu = material.youngs_modulus / (2 * (1 + nu));
  const Scalar lambda = material.youngs_modulus * nu / ((1 + nu) * (1 - 2 * nu));
  Matrix6 d = Matrix6::Zero();
  d.topLeftCorner<3, 3>().setConstant(lambda);
  for (int i = 0; i < 3; ++i) d(i, i) += 2 * mu;
  for (int i = 3; i < 6; ++i) d(i, i) = mu;
  return d;
}

int corner_place(std::size_t corner, int axis) {
  return int(corner >> axis) & 1;
}

// Trilinear weights of the corners at a point of the unit cube.
std::array<Scalar, 8> weights_at(const Vector3& p) {
  std::array<Scalar, 8> weights;
  for (std::size_t c = 0; c < 8; ++c) {
    weights[c] = 1;
    for (int axis = 0; axis < 3; ++axis) {
      weights[c] *= corner_place(c, axis) == 1 ? p[axis] : 1 - p[axis];
    }
  }
  return weights;
}

Gradients gradients_at(const Vector3& p) {
  Gradients gradients;
  for (std::size_t c = 0; c < 8; ++c) {
    for (int along = 0; along < 3; ++along) {
      Scalar product = 1;
      for (int axis = 0; axis < 3; ++axis) {
        const bool is_upper = corner_place(c, axis) == 1;
        product *= axis == along ? (is_upper ? 1 : -1) : (is_upper ? p[axis] : 1 - p[axis]);
      }
      gradients(along, Eigen::Index(c)) = product;
    }
  }
  return gradients;
}

// The strain of a displacement field along axis j with this gradient: xx yy zz yz zx xy.
template <typename Columns>
void set_strain(const Vector3& gradient, Eigen::Index first, Columns& b) {
  for (int j = 0; j < 3; ++j) {
    b(j, first + j) = gradient[j];
    b(3 + (j + 1) % 3, first + j) = gradient[(j + 2) % 3];
    b(3 + (j + 2) % 3, first + j) = gradient[(j + 1) % 3];
  }
}

Matrix6x24 strain_at(const Vector3& p) {
  const Gradients gradients = gradients_at(p);
  Matrix6x24 b = Matrix6x24::Zero();
  for (int c = 0; c < 8; ++c) set_strain(gradients.col(c), 3 * c, b);
  return b;
}

// Wilson's modes: 1 - x^2 of each axis, x from -1 to 1.
Matrix6x9 bubble_strain_at(const Vector3& p) {
  Matrix6x9 b = Matrix6x9::Zero();
  for (int i = 0; i < 3; ++i) {
    Vector3 gradient = Vector3::Zero();
    gradient[i] = 4 - 8 * p[i];  // of 1 - (2 p - 1)^2
    set_strain(gradient, 3 * i, b);
  }
  return b;
}

// Integrates an element over weighted points of the unit cube.
class ElementSum {
 public:
  explicit ElementSum(const Matrix6& d) : d_(d) {}

  void add(const Vector3& p, Scalar weight) {
    const Matrix6x24 b = strain_at(p);
    const Matrix6x9 bubble = bubble_strain_at(p);
    const Matrix6x24 db = weight * d_ * b;
    const Matrix6x9 d_bubble = weight * d_ * bubble;
    stiffness_.noalias() += b.transpose() * db;
    coupling_.noalias() += b.transpose() * d_bubble;
    bubbles_.noalias() += bubble.transpose() * d_bubble;
    strain_ += weight * b;
    bubble_strain_ += weight * bubble;
    gradients_ += weight * gradients_at(p);
    const std::array<Scalar, 8> shares = weights_at(p);
    for (std::size_t c = 0; c < 8; ++c) masses_[c] += weight * shares[c];
    volume_ += weight;
  }

  // The mean of the bubbles' strain is taken out: a constant strain then does not move them, so
  // that uniform strain is exact also in a part of a cube [Taylor1976].
  CubeElement finish(Scalar edge, Scalar density) const {
    const Matrix6x9 mean = bubble_strain_ / volume_;
    const Eigen::Matrix<Scalar, 24, 9> coupling = coupling_ - strain_.transpose() * d_ * mean;
    const Matrix9 bubbles = bubbles_ - volume_ * mean.transpose() * d_ * mean;
    CubeElement element;
    element.stiffness = edge * (stiffness_ - coupling * bubbles.ldlt().solve(coupling.transpose()));
    element.stiffness = (element.stiffness + element.stiffness.transpose()).eval() / 2;
    element.gradients = gradients_ / (volume_ * edge);
    for (std::size_t c = 0; c < 8; ++c)
      element.masses[c] = density * std::pow(edge, 3) * masses_[c];
    return element;
  }

 private:
  Matrix6 d_;
  Matrix24 stiffness_ = Matrix24::Zero();
  Eigen::Matrix<Scalar, 24, 9> coupling_ = Eigen::Matrix<Scalar, 24, 9>::Zero();
  Matrix9 bubbles_ = Matrix9::Zero();
  Matrix6x24 strain_ = Matrix6x24::Zero();
  Matrix6x9 bubble_strain_ = Matrix6x9::Zero();
  Gradients gradients_ = Gradients::Zero();
  std::array<Scalar, 8> masses_{};
  Scalar volume_ = 0;
};

CubeElement full_element(const Matrix6& d, Scalar edge, Scalar density) {
  ElementSum sum(d);
  const Scalar away = 0.5 / std::sqrt(Scalar{3});  // Gauss points
  for (std::size_t c = 0; c < 8; ++c) {
    Vector3 p;
    for (int axis = 0; axis < 3; ++axis) {
      p[axis] = 0.5 + (corner_place(c, axis) == 1 ? away : -away);
    }
    sum.add(p, 0.125);
  }
  return sum.finish(edge, density);
}

Vector3 point_of(int number) {
  Vector3 p;
  for (int axis = 0; axis < 3; ++axis) {
    p[axis] = (Scalar((number * kGenerator[std::size_t(axis)]) % kPoints) + 0.5) / kPoints;
  }
  return p;
}

using Inside = std::bitset<kPoints>;

Inside points_inside(const TriangleMesh& mesh, const Vector3& corner, Scalar edge) {
  Inside inside;
  for (int k = 0; k < kPoints; ++k) {
    inside[std::size_t(k)] = contains(mesh, corner + edge * point_of(k));
  }
  return inside;
}

CubeElement part_element(const Matrix6& d, const Inside& inside, Scalar edge, Scalar density) {
  ElementSum sum(d);
  for (int k = 0; k < kPoints; ++k) {
    sum.add(point_of(k), (inside[std::size_t(k)] ? 1 : kOutside) / kPoints);
  }
  return sum.finish(edge, density);
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
  scale_masses(mesh.compute_mass_properties(options.material.density).mass);
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
          const Inside inside = points_inside(mesh, corner, edge_);
          if (!inside.all()) elements_.push_back(part_element(d, inside, edge_, density));
          add_cube(cell, inside.all() ? 0 : elements_.size() - 1);
        } else if (contains(mesh, corner + Vector3::Constant(edge_ / 2))) {
          add_cube(cell, 0);
        }
      }
    }
  }
}

void TissueLattice::add_cube(const Cell& cell, std::size_t kind) {
  cube_at_[cube_index(cell)] = std::int32_t(cubes_.size());
  kinds_.push_back(kind);
  Corners corners;
  for (std::size_t c = 0; c < 8; ++c) {
    corners[c] = add_node(cell + Cell(corner_place(c, 0), corner_place(c, 1), corner_place(c, 2)));
    masses_[std::size_t(corners[c])] += elements_[kind].masses[c];
  }
  cubes_.push_back(corners);
}

std::int32_t TissueLattice::add_node(const Cell& cell) {
  std::int32_t& node = node_at_[node_index(cell)];
  if (node < 0) {
    node = std::int32_t(nodes_.size());
    nodes_.push_back(origin_ + edge_ * cell.cast<Scalar>());
    cells_.push_back(cell);
    masses_.push_back(0);
  }
  return node;
}

void TissueLattice::embed(std::span<const Vector3> vertices) {
  for (const Vector3& p : vertices) {
    Cell cell = cell_of(p);
    const std::int32_t cube = cube_at_[cube_index(cell)];
    Embedding embedding;
    if (cube >= 0) {  // else a vertex that no triangle uses
      embedding.nodes = cubes_[std::size_t(cube)];
      embedding.weights = weights_at((p - origin_) / edge_ - cell.cast<Scalar>());
    }
    embeddings_.push_back(embedding);
  }
}

void TissueLattice::scale_masses(Scalar mass) {
  Scalar sum = 0;
  for (const Scalar m : masses_) sum += m;
  for (Scalar& m : masses_) m *= mass / sum;
}

}  // namespace dyop::tissue_internal
