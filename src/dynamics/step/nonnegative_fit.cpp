// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/nonnegative_fit.h"

#include <Eigen/QR>
#include <algorithm>
#include <utility>

namespace dyop::dynamics_internal {

bool NonnegativeFit::add(Eigen::VectorXd values, std::size_t number) {
  columns_.push_back({std::move(values), number, 0});
  const bool is_used = fit();
  residual_ = target_;
  for (const Column& column : columns_) residual_ -= column.weight * column.values;
  return is_used;
}

// Moves the weights towards those of unconstrained least squares. The first column whose weight
// falls to zero on the way is dropped, and the others are fitted again.
bool NonnegativeFit::fit() {
  while (!columns_.empty()) {
    Eigen::MatrixXd matrix(target_.size(), Eigen::Index(columns_.size()));
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      matrix.col(Eigen::Index(i)) = columns_[i].values;
    }
    const Eigen::VectorXd wanted = matrix.colPivHouseholderQr().solve(target_);
    const std::size_t last = columns_.size() - 1;
    if (!(wanted[Eigen::Index(last)] > 0)) return false;
    Scalar part = 1;
    std::size_t first = last;  // whose weight falls to zero first; `last` if none does
    for (std::size_t i = 0; i < last; ++i) {
      const Scalar next = wanted[Eigen::Index(i)];
      if (next > 0) continue;
      const Scalar at = columns_[i].weight / (columns_[i].weight - next);
      if (at < part) first = i;
      part = std::min(part, at);
    }
    for (std::size_t i = 0; i <= last; ++i) {
      columns_[i].weight += part * (wanted[Eigen::Index(i)] - columns_[i].weight);
    }
    if (first == last) return true;
    columns_.erase(columns_.begin() + std::ptrdiff_t(first));
  }
  return false;
}

}  // namespace dyop::dynamics_internal
