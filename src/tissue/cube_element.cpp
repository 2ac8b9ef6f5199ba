// SPDX-License-Identifier: BSD-3-Clause
#include "tissue/cube_element.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace dyop::tissue_internal {
namespace {

// The samples are a rank-1 lattice, whose projection on each axis has all of them, evenly spread,
// so faces along the axes are placed to 1 %.
constexpr std::array<int, 3> kGenerator{1, 40, 85};  // 40^2 = 85 modulo 101

using Matrix9 = Eigen::Matrix<Scalar, 9, 9>;
using Matrix6x24 = Eigen::Matrix<Scalar, 6, 24>;
using Matrix6x9 = Eigen::Matrix<Scalar, 6, 9>;

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

  void add(const Vector3& p, Scalar weight, Scalar mass) {
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
    for (std::size_t c = 0; c < 8; ++c) masses_[c] += mass * shares[c];
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

}  // namespace

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

CubeElement full_element(const Matrix6& d, Scalar edge, Scalar density) {
  ElementSum sum(d);
  const Scalar away = 0.5 / std::sqrt(Scalar{3});  // Gauss points
  for (std::size_t c = 0; c < 8; ++c) {
    Vector3 p;
    for (int axis = 0; axis < 3; ++axis) {
      p[axis] = 0.5 + (corner_place(c, axis) == 1 ? away : -away);
    }
    sum.add(p, 0.125, 0.125);
  }
  return sum.finish(edge, density);
}

Vector3 sample_place(std::size_t number) {
  Vector3 p;
  for (int axis = 0; axis < 3; ++axis) {
    p[axis] = (Scalar((int(number) * kGenerator[std::size_t(axis)]) % kSamples) + 0.5) / kSamples;
  }
  return p;
}

CubeElement part_element(const Matrix6& d, const Samples& material, const Samples& light,
                         Scalar edge, Scalar density) {
  ElementSum sum(d);
  for (std::size_t k = 0; k < kSamples; ++k) {
    const Scalar mass = material[k] ? 1 : light[k] ? kOutside : 0;
    sum.add(sample_place(k), (material[k] ? 1 : kOutside) / kSamples, mass / kSamples);
  }
  return sum.finish(edge, density);
}

}  // namespace dyop::tissue_internal
