// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <utility>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::dynamics_internal {

/// Nonnegative least squares by the active-set method of [LawsonHanson1974]: the weighted sum of
/// columns, with weights >= 0, that is nearest to a target. The caller adds the columns one by one,
/// each time the one that best points along the residual.
class NonnegativeFit {
 public:
  struct Column {
    Eigen::VectorXd values;
    std::size_t number = 0;  ///< by which the caller knows it
    Scalar weight = 0;
  };

  explicit NonnegativeFit(Eigen::VectorXd target)
      : target_(std::move(target)), residual_(target_) {}

  /// Adds a column and finds the best weights; columns whose weight falls to zero are dropped.
  /// Returns false if the new column gets no weight.
  bool add(Eigen::VectorXd values, std::size_t number);
  const std::vector<Column>& columns() const { return columns_; }
  /// Target minus the weighted sum.
  const Eigen::VectorXd& residual() const { return residual_; }

 private:
  bool fit();

  Eigen::VectorXd target_;
  Eigen::VectorXd residual_;
  std::vector<Column> columns_;
};

}  // namespace dyop::dynamics_internal
