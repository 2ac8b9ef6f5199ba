// SPDX-License-Identifier: BSD-3-Clause
#include "view/tool/tissue_modes.h"

#include <algorithm>
#include <cmath>

namespace dyop::view_internal {
namespace {

Scalar product(std::span<const Vector3> a, std::span<const Vector3> b) {
  Scalar sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += a[k].dot(b[k]);
  return sum;
}

void subtract(Scalar weight, std::span<const Vector3> mode, std::vector<Vector3>& from) {
  for (std::size_t k = 0; k < from.size(); ++k) from[k] -= weight * mode[k];
}

Scalar longest(std::span<const Vector3> vectors) {
  Scalar most = 0;
  for (const Vector3& v : vectors) most = std::max(most, v.norm());
  return most;
}

}  // namespace

TissueModes::TissueModes(std::vector<Vector3> vertices, Scalar tolerance, std::size_t most_modes)
    : vertices_(std::move(vertices)), tolerance_(tolerance), most_modes_(most_modes) {}

std::vector<Scalar> TissueModes::add(std::span<const Vector3> snapshot) {
  rest_.resize(vertices_.size());
  for (std::size_t k = 0; k < rest_.size(); ++k) rest_[k] = snapshot[k] - vertices_[k];
  std::vector<Scalar> weights(modes_.size());
  for (int pass = 0; pass < 2; ++pass) {  // the second for what rounding left
    for (std::size_t k = 0; k < modes_.size(); ++k) {
      const Scalar weight = product(rest_, modes_[k]);
      subtract(weight, modes_[k], rest_);
      weights[k] += weight;
    }
  }
  const Scalar error = longest(rest_);
  if (error > tolerance_ && modes_.size() < most_modes_) {
    const Scalar size = std::sqrt(product(rest_, rest_));
    for (Vector3& v : rest_) v /= size;
    modes_.push_back(rest_);
    weights.push_back(size);
  } else {
    worst_ = std::max(worst_, error);
  }
  return weights;
}

}  // namespace dyop::view_internal
