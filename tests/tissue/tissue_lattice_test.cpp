// SPDX-License-Identifier: BSD-3-Clause
#include "tissue/tissue_lattice.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <random>

#include "dyop/core/rigid_pose.h"
#include "support/inputs/random_inputs.h"
#include "support/inputs/tissue_bars.h"

namespace dyop::tissue_internal {
namespace {

SoftTissueOptions options_for(Scalar edge, Scalar ratio = 0.3) {
  SoftTissueOptions options;
  options.material = {2, ratio, 1.5, 0, 0};
  options.cube_edge = edge;
  options.period = 0.01;
  return options;
}

TriangleMesh turned_box(const Vector3& size, std::mt19937_64& random) {
  const auto arrays = testing::divided_box(size, {3, 2, 2}, testing::random_pose(3, random));
  return TriangleMesh(arrays.vertices, arrays.triangles);
}

Vector24 field_of(const TissueLattice& lattice, std::size_t cube, const auto& displacement) {
  Vector24 u;
  for (std::size_t c = 0; c < 8; ++c) {
    u.segment<3>(3 * Eigen::Index(c)) =
        displacement(lattice.nodes()[std::size_t(lattice.cubes()[cube][c])]);
  }
  return u;
}

TEST(TissueLattice, PlacesEveryVertex) {
  std::mt19937_64 random(1);
  for (int k = 0; k < 5; ++k) {
    const TriangleMesh mesh = turned_box({2, 1, 0.7}, random);
    const TissueLattice lattice(mesh, options_for(0.3));
    for (std::size_t v = 0; v < mesh.vertices().size(); ++v) {
      const Embedding& embedding = lattice.embeddings()[v];
      Vector3 p = Vector3::Zero();
      Scalar sum = 0;
      for (std::size_t c = 0; c < 8; ++c) {
        EXPECT_GE(embedding.weights[c], -1e-12);
        p += embedding.weights[c] * lattice.nodes()[std::size_t(embedding.nodes[c])];
        sum += embedding.weights[c];
      }
      EXPECT_LE((p - mesh.vertices()[v]).norm(), 1e-12);
      EXPECT_NEAR(sum, 1, 1e-12);
    }
  }
}

// A rigid motion has no energy in any cube, whole or cut; a uniform strain has that of Hooke's law
// times the volume inside: the patch test. Without the surface's last bits, so within a few percent
// of the box's volume; the sum of all cubes' masses says how much of it there is.
TEST(TissueLattice, PassesThePatchTest) {
  std::mt19937_64 random(2);
  for (const Scalar ratio : {-0.5, 0.0, 0.3, 0.49}) {
    const TriangleMesh mesh = turned_box({2, 1, 0.7}, random);
    const SoftTissueOptions options = options_for(0.3, ratio);
    const TissueLattice lattice(mesh, options);
    const Matrix3 skew =
        Matrix3::NullaryExpr([&] { return testing::random_number(-1, 1, random); });
    const Matrix3 strain = (skew + skew.transpose()) / 2;
    const Scalar mu = 2 / (2 * (1 + ratio)), lambda = 2 * ratio / ((1 + ratio) * (1 - 2 * ratio));
    const Scalar density = mu * strain.squaredNorm() + lambda / 2 * std::pow(strain.trace(), 2);
    for (std::size_t k = 0; k < lattice.cubes().size(); ++k) {
      const CubeElement& element = lattice.element(k);
      const Vector24 moved = field_of(lattice, k, [&](const Vector3& p) {
        return Vector3((skew - skew.transpose()) * p + Vector3(3, 2, 1));
      });
      EXPECT_LE((element.stiffness * moved).norm(), 1e-11);
      const Vector24 strained =
          field_of(lattice, k, [&](const Vector3& p) { return Vector3(strain * p); });
      Scalar mass = 0;
      for (const Scalar m : element.masses) mass += m;
      const Scalar expected = density * mass / 1.5;
      EXPECT_NEAR(strained.dot(element.stiffness * strained) / 2, expected, 1e-9 * density);
      Matrix3 gradient = Matrix3::Zero();
      for (Eigen::Index c = 0; c < 8; ++c) {
        gradient += strained.segment<3>(3 * c) * element.gradients.col(c).transpose();
      }
      EXPECT_LE((gradient - strain).norm(), 1e-11);
    }
  }
}

TEST(TissueLattice, HasNoCubeThatDeformsForNothing) {
  std::mt19937_64 random(3);
  const TissueLattice lattice(turned_box({2, 1, 0.7}, random), options_for(0.3, 0.45));
  for (std::size_t k = 0; k < lattice.cubes().size(); ++k) {
    const Eigen::SelfAdjointEigenSolver<Matrix24> eigen(lattice.element(k).stiffness);
    const Scalar largest = eigen.eigenvalues()[23];
    EXPECT_GE(eigen.eigenvalues()[0], -1e-12 * largest);
    EXPECT_GT(eigen.eigenvalues()[6], 0) << "only the six rigid motions";
    EXPECT_GT(eigen.eigenvalues()[6], 1e3 * std::abs(eigen.eigenvalues()[5]));
  }
}

TEST(TissueLattice, CoversThinSheetsAndSpikes) {
  const auto sheet = testing::divided_box({2, 2, 0.01}, {6, 6, 1});
  const TissueLattice lattice(TriangleMesh(sheet.vertices, sheet.triangles), options_for(0.3));
  EXPECT_EQ(lattice.cubes().size(), 49u);
  testing::MeshArrays spike = testing::divided_box({1, 1, 1}, {1, 1, 1});
  for (Vector3& p : spike.vertices) {
    if (p.norm() > 1.7) p *= 5;
  }
  const TriangleMesh mesh(spike.vertices, spike.triangles);
  const TissueLattice of_spike(mesh, options_for(0.2));
  Scalar mass = 0;
  for (const Scalar m : of_spike.masses()) {
    EXPECT_GT(m, 0);
    mass += m;
  }
  EXPECT_NEAR(mass, mesh.compute_mass_properties(1.5).mass, 1e-12);
}

}  // namespace
}  // namespace dyop::tissue_internal
