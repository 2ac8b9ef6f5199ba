// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::tissue_internal {

enum class ConeState { Open, Stick, Slip };

struct ConeAnswer {
  Eigen::VectorXd forces;         ///< inside their cones
  std::vector<ConeState> states;  ///< of the contacts
  int rounds = 0;
  bool is_exact = false;  ///< otherwise the forces are the last of many projected sweeps
};

/// A few contacts that all act on each other, three numbers each: along the normal, then along two
/// tangents. Forces f give the relative displacements r = free + compliance f, with the laws
/// f_n >= 0, r_n >= 0, f_n r_n = 0, and Coulomb's: |f_t| <= friction f_n, with f_t against r_t
/// where that is not zero.
///
/// Semismooth Newton on the laws as a projection [AlartCurnier1991]: with y = f - r / w, w the mean
/// compliance of a contact, f is y projected first on f_n >= 0, then on |f_t| <= friction max(0,
/// y_n). A factor is used again, also by the next solve(), as long as it helps.
class ConeSolver {
 public:
  /// @param compliance Symmetric, positive definite; must outlive this.
  ConeSolver(const Eigen::MatrixXd& compliance, Scalar friction);

  /// @param guess Of the forces; empty: none.
  ConeAnswer solve(const Eigen::VectorXd& free, const Eigen::VectorXd& guess = {});

 private:
  // The derivatives of a loaded contact's residual by its displacement and by its force.
  struct Mix {
    Matrix3 of_apart = Matrix3::Identity();
    Matrix3 of_force = Matrix3::Zero();
  };
  Scalar weight(Eigen::Index c) const;
  Vector3 target(Eigen::Index c) const;
  Scalar radius(const Vector3& y) const;
  Mix mix_of(Eigen::Index c) const;
  Scalar evaluate();
  bool try_last_factor(Scalar& error);
  void newton_round(Scalar& error);
  void factorise();
  void find_step();
  std::vector<Eigen::Index> loaded() const;
  void project(Eigen::Index c);
  void sweep();
  ConeState state(Eigen::Index c) const;

  const Eigen::MatrixXd& compliance_;
  const Scalar friction_;
  const Eigen::Index count_;
  Scalar unit_ = 1;           // the mean compliance
  Eigen::MatrixXf in_units_;  // the compliance
  Eigen::VectorXd free_;
  Eigen::VectorXd forces_;
  Eigen::VectorXd apart_;
  Eigen::VectorXd residual_;
  // The last factor: of these contacts.
  std::vector<Eigen::Index> active_;
  std::vector<Matrix3> mixes_;  // of their displacements
  Eigen::MatrixXf matrix_;
  Eigen::PartialPivLU<Eigen::MatrixXf> factor_;
  Eigen::VectorXd step_;
};

}  // namespace dyop::tissue_internal
