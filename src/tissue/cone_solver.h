// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::tissue_internal {

enum class ConeState { Open, Stick, Slip };

/// A few contacts that all act on each other, three numbers each: along the normal, then along two
/// tangents. Forces f give the relative displacements r = free + compliance f, with the laws
/// f_n >= 0, r_n >= 0, f_n r_n = 0, and Coulomb's: |f_t| <= friction f_n, with f_t against r_t
/// where that is not zero.
struct ConeProblem {
  Eigen::MatrixXd compliance;  ///< symmetric, positive definite
  Eigen::VectorXd free;
  Scalar friction = 0;
  Eigen::VectorXd guess = {};  ///< of the forces; empty: none
};

struct ConeAnswer {
  Eigen::VectorXd forces;         ///< inside their cones
  std::vector<ConeState> states;  ///< of the contacts
  int rounds = 0;
  bool is_exact = false;  ///< otherwise the forces are the last of many projected sweeps
};

ConeAnswer solve_cones(const ConeProblem& problem);

}  // namespace dyop::tissue_internal
