// SPDX-License-Identifier: BSD-3-Clause
#include "tissue/cone_solver.h"

#include <algorithm>

namespace dyop::tissue_internal {

using Eigen::Index;

namespace {

constexpr int kMostRounds = 30;
constexpr int kHalvings = 4;  // of a round's step
constexpr int kSweeps = 300;
// Largest residual, relative to the largest displacement without forces, that counts as solved.
constexpr Scalar kSolved = 1e-8;  // literal: far below what a hand feels; rounding is 1e-13
// A step with the last factor must leave so little of the residual; a new factor takes as long as
// some ten such steps.
constexpr Scalar kWorthAStep = 0.2;

}  // namespace

ConeSolver::ConeSolver(const Eigen::MatrixXd& compliance, Scalar friction)
    : compliance_(compliance), friction_(friction), count_(compliance.rows() / 3) {
  if (count_ == 0) return;
  unit_ = compliance.trace() / Scalar(compliance.rows());
  in_units_ = (compliance / unit_).cast<float>();
}

ConeAnswer ConeSolver::solve(const Eigen::VectorXd& free, const Eigen::VectorXd& guess) {
  ConeAnswer answer;
  free_ = free;
  forces_ = guess.size() == free.size() ? guess : Eigen::VectorXd::Zero(free.size());
  Scalar error = evaluate();
  const Scalar enough = count_ > 0 ? kSolved * free.cwiseAbs().maxCoeff() : 0;
  for (int factors = 0; error > enough && factors < kMostRounds;) {
    ++answer.rounds;
    if (try_last_factor(error)) continue;
    newton_round(error);
    ++factors;
  }
  answer.is_exact = error <= enough;
  if (!answer.is_exact) sweep();
  for (Index c = 0; c < count_; ++c) project(c);
  answer.forces = forces_;
  for (Index c = 0; c < count_; ++c) answer.states.push_back(state(c));
  return answer;
}

Scalar ConeSolver::weight(Index c) const {
  return compliance_.block<3, 3>(3 * c, 3 * c).trace() / 3;
}

Vector3 ConeSolver::target(Index c) const {
  return forces_.segment<3>(3 * c) - apart_.segment<3>(3 * c) / weight(c);
}

Scalar ConeSolver::radius(const Vector3& y) const {
  return friction_ * std::max(Scalar{0}, y[0]);
}

// Finds r and the residual w (f - projection of y); returns its largest number.
Scalar ConeSolver::evaluate() {
  apart_ = free_;
  apart_.noalias() += compliance_ * forces_;
  residual_.resize(forces_.size());
  for (Index c = 0; c < count_; ++c) {
    const Vector3 y = target(c);
    Vector3 projected = y;
    projected[0] = std::max(Scalar{0}, y[0]);
    const Scalar tangential = y.tail<2>().norm();
    if (tangential > radius(y)) projected.tail<2>() *= radius(y) / tangential;
    residual_.segment<3>(3 * c) = weight(c) * (forces_.segment<3>(3 * c) - projected);
  }
  return count_ > 0 ? residual_.cwiseAbs().maxCoeff() : 0;
}

// Those whose y_n is positive; the others lose their force.
std::vector<Index> ConeSolver::loaded() const {
  std::vector<Index> found;
  for (Index c = 0; c < count_; ++c) {
    if (target(c)[0] > 0) found.push_back(c);
  }
  return found;
}

// Whether the factor of an earlier round brought the solution much nearer.
bool ConeSolver::try_last_factor(Scalar& error) {
  if (active_.empty() || loaded() != active_) return false;
  find_step();
  const Eigen::VectorXd start = forces_;
  forces_ += step_;
  const Scalar next = evaluate();
  if (next < kWorthAStep * error) {
    error = next;
    return true;
  }
  forces_ = start;
  evaluate();
  return false;
}

void ConeSolver::newton_round(Scalar& error) {
  active_ = loaded();
  factorise();
  find_step();
  const Eigen::VectorXd start = forces_;
  Scalar part = 1;
  for (int k = 0; k <= kHalvings; ++k, part /= 2) {
    forces_ = start + part * step_;
    const Scalar next = evaluate();
    if (next < error || k == kHalvings) {
      error = next;
      break;
    }
  }
}

// The residual's derivative by the loaded contacts' forces. In single precision, which takes half
// the time: what a step lacks the next round corrects. In units of the mean compliance and of the
// largest residual no number leaves its range.
void ConeSolver::factorise() {
  mixes_.clear();
  const Index size = 3 * Index(active_.size());
  matrix_.resize(size, size);
  for (Index i = 0; i < Index(active_.size()); ++i) {
    const Index c = active_[std::size_t(i)];
    const Mix mix = mix_of(c);
    mixes_.push_back(mix.of_apart);
    const Eigen::Matrix3f of_apart = mix.of_apart.cast<float>();
    for (Index k = 0; k < Index(active_.size()); ++k) {
      matrix_.block<3, 3>(3 * i, 3 * k) =
          of_apart * in_units_.block<3, 3>(3 * c, 3 * active_[std::size_t(k)]);
    }
    matrix_.block<3, 3>(3 * i, 3 * i) += (mix.of_force / unit_).cast<float>();
  }
  if (size > 0) factor_.compute(matrix_);
}

void ConeSolver::find_step() {
  step_ = -forces_;
  for (const Index c : active_) step_.segment<3>(3 * c).setZero();
  Eigen::VectorXd known = Eigen::VectorXd::Zero(step_.size());
  if (!step_.isZero(0)) known.noalias() += compliance_ * step_;
  if (active_.empty()) return;
  const Scalar length = residual_.cwiseAbs().maxCoeff();
  Eigen::VectorXf wanted(3 * Index(active_.size()));
  for (std::size_t i = 0; i < active_.size(); ++i) {
    const Index c = active_[i];
    wanted.segment<3>(3 * Index(i)) =
        ((-residual_.segment<3>(3 * c) - mixes_[i] * known.segment<3>(3 * c)) / length)
            .cast<float>();
  }
  const Eigen::VectorXf found = factor_.solve(wanted);
  for (std::size_t i = 0; i < active_.size(); ++i) {
    step_.segment<3>(3 * active_[i]) =
        length / unit_ * found.segment<3>(3 * Index(i)).cast<Scalar>();
  }
}

ConeSolver::Mix ConeSolver::mix_of(Index c) const {
  Mix mix;
  const Vector3 y = target(c);
  const Scalar w = weight(c), tangential = y.tail<2>().norm();
  if (tangential <= radius(y)) return mix;  // sticks
  const Vector2 along = y.tail<2>() / tangential;
  const Eigen::Matrix2d across =
      radius(y) / tangential * (Eigen::Matrix2d::Identity() - along * along.transpose());
  mix.of_apart.bottomRightCorner<2, 2>() = across;
  mix.of_apart.bottomLeftCorner<2, 1>() = friction_ * along;
  mix.of_force.bottomRightCorner<2, 2>() = w * (Eigen::Matrix2d::Identity() - across);
  mix.of_force.bottomLeftCorner<2, 1>() = -w * friction_ * along;
  return mix;
}

void ConeSolver::project(Index c) {
  auto force = forces_.segment<3>(3 * c);
  force[0] = std::max(force[0], Scalar{0});
  const Scalar most = friction_ * force[0], tangential = force.tail<2>().norm();
  if (tangential > most) force.tail<2>() *= most / tangential;
}

// Projected Gauss-Seidel from zero, for problems on which Newton's method cycles.
void ConeSolver::sweep() {
  forces_.setZero();
  for (int k = 0; k < kSweeps; ++k) {
    for (Index c = 0; c < count_; ++c) {
      const auto rows = compliance_.middleRows<3>(3 * c);
      const Matrix3 own = rows.middleCols<3>(3 * c);
      Vector3 apart = free_.segment<3>(3 * c) + rows * forces_;
      const Scalar before = forces_[3 * c];
      forces_[3 * c] = std::max(Scalar{0}, before - apart[0] / own(0, 0));
      apart += own.col(0) * (forces_[3 * c] - before);
      forces_.segment<2>(3 * c + 1) -= apart.tail<2>() / own.bottomRightCorner<2, 2>().trace();
      project(c);
    }
  }
}

ConeState ConeSolver::state(Index c) const {
  const Scalar normal = forces_[3 * c], tangential = forces_.segment<2>(3 * c + 1).norm();
  if (!(normal > 0)) return ConeState::Open;
  constexpr Scalar kOnCone = 1e-6;  // literal: relative, above what solving leaves
  return tangential < (1 - kOnCone) * friction_ * normal ? ConeState::Stick : ConeState::Slip;
}

}  // namespace dyop::tissue_internal
