// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <bitset>
#include <cstdint>

#include "dyop/tissue/soft_tissue.h"

namespace dyop::tissue_internal {

using Matrix6 = Eigen::Matrix<Scalar, 6, 6>;
using Matrix24 = Eigen::Matrix<Scalar, 24, 24>;
using Vector24 = Eigen::Matrix<Scalar, 24, 1>;
using Gradients = Eigen::Matrix<Scalar, 3, 8>;

/// A cube of the lattice at rest, or the part of one inside the surface: trilinear, with Wilson's
/// incompatible modes condensed [Wilson1973], so that bending does not lock.
struct CubeElement {
  Matrix24 stiffness = Matrix24::Zero();
  /// Of the mean deformation gradient: F = sum over corners of x (its column)^T.
  Gradients gradients = Gradients::Zero();
  std::array<Scalar, 8> masses{};  ///< of the corners
};

/// Of what lies outside the surface, relative to the material.
inline constexpr Scalar kOutside = 1e-3;
/// Points at which a cube that the surface crosses is examined.
inline constexpr int kSamples = 101;
using Samples = std::bitset<kSamples>;

/// A sample's place in the unit cube.
Vector3 sample_place(std::size_t number);

/// Bit `axis` of a corner: 1 on the upper side.
constexpr int corner_place(std::size_t corner, int axis) {
  return int(corner >> axis) & 1;
}
/// Trilinear weights of the corners at a point of the unit cube.
std::array<Scalar, 8> weights_at(const Vector3& p);
/// Their gradients, a column each.
Gradients gradients_at(const Vector3& p);

/// Hooke's law for strains xx yy zz yz zx xy.
Matrix6 elasticity(const TissueMaterial& material);
CubeElement full_element(const Matrix6& d, Scalar edge, Scalar density);
/// Samples that are not material count a thousandth for the stiffness; for the masses too if they
/// are `light`.
CubeElement part_element(const Matrix6& d, const Samples& material, const Samples& light,
                         Scalar edge, Scalar density);

}  // namespace dyop::tissue_internal
