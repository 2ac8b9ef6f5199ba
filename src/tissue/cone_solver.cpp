// SPDX-License-Identifier: BSD-3-Clause
#include "tissue/cone_solver.h"

#include <Eigen/LU>
#include <algorithm>

namespace dyop::tissue_internal {
namespace {

using Eigen::Index;

constexpr int kMostRounds = 30;
constexpr int kHalvings = 4;  // of a round's step
constexpr int kSweeps = 300;
// Largest residual, relative to the largest displacement without forces, that counts as solved.
constexpr Scalar kSolved = 1e-8;  // literal: far below what a hand feels; rounding is 1e-13

// Semismooth Newton on the laws as a projection [AlartCurnier1991]: with y = f - r / w, w the mean
// compliance of a contact, f is y projected first on f_n >= 0, then on |f_t| <= friction max(0, y_n).
class ConeRun {
 public:
  explicit ConeRun(const ConeProblem& problem)
      : problem_(problem),
        count_(problem.free.size() / 3),
        forces_(problem.guess.size() == problem.free.size()
                    ? problem.guess
                    : Eigen::VectorXd(Eigen::VectorXd::Zero(problem.free.size()))) {
    if (count_ == 0) return;
    enough_ = kSolved * problem.free.cwiseAbs().maxCoeff();
    unit_ = problem.compliance.trace() / Scalar(problem.free.size());
  }

  ConeAnswer run() {
    ConeAnswer answer;
    Scalar error = evaluate(forces_);
    while (error > enough_ && answer.rounds < kMostRounds) {
      ++answer.rounds;
      const Eigen::VectorXd step = newton_step();
      const Eigen::VectorXd start = forces_;
      Scalar part = 1;
      for (int k = 0; k <= kHalvings; ++k, part /= 2) {
        forces_ = start + part * step;
        const Scalar next = evaluate(forces_);
        if (next < error || k == kHalvings) {
          error = next;
          break;
        }
      }
    }
    answer.is_exact = error <= enough_;
    if (!answer.is_exact) sweep();
    for (Index c = 0; c < count_; ++c) project(c);
    answer.forces = forces_;
    for (Index c = 0; c < count_; ++c) answer.states.push_back(state(c));
    return answer;
  }

 private:
  Scalar weight(Index c) const { return problem_.compliance.block<3, 3>(3 * c, 3 * c).trace() / 3; }
  Vector3 target(Index c, const Eigen::VectorXd& forces) const {
    return forces.segment<3>(3 * c) - apart_.segment<3>(3 * c) / weight(c);
  }
  Scalar radius(const Vector3& y) const { return problem_.friction * std::max(Scalar{0}, y[0]); }

  // Finds r and the residual w (f - projection of y); returns its largest number.
  Scalar evaluate(const Eigen::VectorXd& forces) {
    apart_ = problem_.free + problem_.compliance * forces;
    residual_.resize(forces.size());
    for (Index c = 0; c < count_; ++c) {
      const Vector3 y = target(c, forces);
      Vector3 projected = y;
      projected[0] = std::max(Scalar{0}, y[0]);
      const Scalar tangential = y.tail<2>().norm();
      if (tangential > radius(y)) projected.tail<2>() *= radius(y) / tangential;
      residual_.segment<3>(3 * c) = weight(c) * (forces.segment<3>(3 * c) - projected);
    }
    return count_ > 0 ? residual_.cwiseAbs().maxCoeff() : 0;
  }

  // Contacts whose y_n is not positive lose their force; of the others the residual's derivative. In
  // single precision, which takes half the time: what a step lacks the next round corrects. In units
  // of the mean compliance and of the largest residual no number leaves its range.
  Eigen::VectorXd newton_step() {
    step_ = Eigen::VectorXd::Zero(forces_.size());
    active_.clear();
    for (Index c = 0; c < count_; ++c) {
      if (target(c, forces_)[0] > 0) {
        active_.push_back(c);
      } else {
        step_.segment<3>(3 * c) = -forces_.segment<3>(3 * c);
      }
    }
    const auto size = 3 * Index(active_.size());
    matrix_.resize(size, size);
    Eigen::VectorXf wanted(size);
    const Eigen::VectorXd known = problem_.compliance * step_;
    const Scalar length = residual_.cwiseAbs().maxCoeff();
    for (Index i = 0; i < Index(active_.size()); ++i) {
      const Index c = active_[std::size_t(i)];
      const Mix mix = mix_of(c);
      for (Index k = 0; k < Index(active_.size()); ++k) {
        matrix_.block<3, 3>(3 * i, 3 * k) =
            (mix.of_apart * problem_.compliance.block<3, 3>(3 * c, 3 * active_[std::size_t(k)]) /
             unit_)
                .cast<float>();
      }
      matrix_.block<3, 3>(3 * i, 3 * i) += (mix.of_force / unit_).cast<float>();
      wanted.segment<3>(3 * i) =
          ((-residual_.segment<3>(3 * c) - mix.of_apart * known.segment<3>(3 * c)) / length)
              .cast<float>();
    }
    const Eigen::VectorXf found = matrix_.partialPivLu().solve(wanted);
    for (Index i = 0; i < Index(active_.size()); ++i) {
      step_.segment<3>(3 * active_[std::size_t(i)]) =
          length / unit_ * found.segment<3>(3 * i).cast<Scalar>();
    }
    return step_;
  }

  // The derivatives of a loaded contact's residual by its displacement and by its force.
  struct Mix {
    Matrix3 of_apart = Matrix3::Identity();
    Matrix3 of_force = Matrix3::Zero();
  };
  Mix mix_of(Index c) const {
    Mix mix;
    const Vector3 y = target(c, forces_);
    const Scalar w = weight(c), tangential = y.tail<2>().norm();
    if (tangential <= radius(y)) return mix;  // sticks
    const Vector2 along = y.tail<2>() / tangential;
    const Eigen::Matrix2d across =
        radius(y) / tangential * (Eigen::Matrix2d::Identity() - along * along.transpose());
    mix.of_apart.bottomRightCorner<2, 2>() = across;
    mix.of_apart.bottomLeftCorner<2, 1>() = problem_.friction * along;
    mix.of_force.bottomRightCorner<2, 2>() = w * (Eigen::Matrix2d::Identity() - across);
    mix.of_force.bottomLeftCorner<2, 1>() = -w * problem_.friction * along;
    return mix;
  }

  void project(Index c) {
    auto force = forces_.segment<3>(3 * c);
    force[0] = std::max(force[0], Scalar{0});
    const Scalar most = problem_.friction * force[0], tangential = force.tail<2>().norm();
    if (tangential > most) force.tail<2>() *= most / tangential;
  }

  // Projected Gauss-Seidel from zero, for problems on which Newton's method cycles.
  void sweep() {
    forces_.setZero();
    for (int k = 0; k < kSweeps; ++k) {
      for (Index c = 0; c < count_; ++c) {
        const auto rows = problem_.compliance.middleRows<3>(3 * c);
        const Matrix3 own = rows.middleCols<3>(3 * c);
        Vector3 apart = problem_.free.segment<3>(3 * c) + rows * forces_;
        const Scalar before = forces_[3 * c];
        forces_[3 * c] = std::max(Scalar{0}, before - apart[0] / own(0, 0));
        apart += own.col(0) * (forces_[3 * c] - before);
        forces_.segment<2>(3 * c + 1) -= apart.tail<2>() / own.bottomRightCorner<2, 2>().trace();
        project(c);
      }
    }
  }

  ConeState state(Index c) const {
    const Scalar normal = forces_[3 * c], tangential = forces_.segment<2>(3 * c + 1).norm();
    if (!(normal > 0)) return ConeState::Open;
    constexpr Scalar kOnCone = 1e-6;  // literal: relative, above what solving leaves
    return tangential < (1 - kOnCone) * problem_.friction * normal ? ConeState::Stick
                                                                   : ConeState::Slip;
  }

  const ConeProblem& problem_;
  Index count_;
  Eigen::VectorXd forces_;
  Eigen::VectorXd apart_;
  Eigen::VectorXd residual_;
  Scalar enough_ = 0;
  Scalar unit_ = 1;
  std::vector<Index> active_;
  Eigen::MatrixXf matrix_;
  Eigen::VectorXd step_;
};

}  // namespace

ConeAnswer solve_cones(const ConeProblem& problem) {
  return ConeRun(problem).run();
}

}  // namespace dyop::tissue_internal
