// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/self_stress.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/tolerance.h"
#include "dynamics/step/nonnegative_fit.h"

namespace dyop::dynamics_internal {
namespace {

// Relative to the work that is asked for, 1: a smaller imbalance counts as balance, a smaller gain
// as no progress.
constexpr Scalar kLeastImbalance = 1e-5;  // literal: far above rounding, far below friction's error
constexpr int kMostColumns = 100;
// Larger islands would take longer than a step may, and rarely fit into so many columns.
constexpr std::size_t kMostBodies = 200;

// Impulses along one direction at one contact, or at one row of a joint.
struct Generator {
  std::size_t index = 0;       // of the contact or row
  std::optional<Scalar> sign;  // of a row
  Vector3 impulse_W = Vector3::Zero();
  Vector3 angular_W = Vector3::Zero();
  Scalar prescribed_work = 0;  // on the bodies that move as they are given
  Eigen::VectorXd column;
};

// Least squares over impulses that push: | imbalance |^2 + | work + 1 |^2. Its
// columns are not listed beforehand: the next one is always the best direction in the cones.
class StressSearch {
 public:
  StressSearch(const ContactProblem& problem, std::size_t movable);
  bool find(Scalar imbalance);
  SelfStress stress() const;

 private:
  Generator impulse_at(std::size_t contact, const Vector3& impulse_W,
                       const Vector3& angular_W) const;
  Generator impulse_of_row(std::size_t row, Scalar sign) const;
  Generator column_of(std::size_t a, std::size_t b, const Vector3& j_av_W, const Vector3& j_aw_W,
                      const Vector3& j_bv_W, const Vector3& j_bw_W) const;
  Generator steepest(std::size_t contact) const;
  bool add_best();

  const ContactProblem& problem_;
  std::size_t movable_;
  Scalar length_ = 0;  // mean lever arm: a torque over it counts like a force
  Scalar speed_ = 0;   // largest of given velocities, targets and sticking velocities
  std::vector<Scalar> stiffest_linear_, stiffest_angular_;
  std::vector<Generator> tried_;
  NonnegativeFit fit_;
};

Scalar friction_of(const ContactProblem& problem, const PointContact& contact) {
  if (problem.friction_law) return 0;
  return contact.ellipse ? std::min(contact.friction, contact.ellipse->across) : contact.friction;
}

// Work of -1.
Eigen::VectorXd wanted_work(std::size_t movable) {
  Eigen::VectorXd target = Eigen::VectorXd::Zero(Eigen::Index(6 * movable + 1));
  target[target.size() - 1] = -1;
  return target;
}

StressSearch::StressSearch(const ContactProblem& problem, std::size_t movable)
    : problem_(problem), movable_(movable), fit_(wanted_work(movable)) {
  for (std::size_t i = 0; i < movable; ++i) {
    stiffest_linear_.push_back(problem.bodies[i].inverse_mass_W.cwiseAbs().maxCoeff());
    stiffest_angular_.push_back(problem.bodies[i].inverse_inertia_W.cwiseAbs().maxCoeff());
  }
  for (const PointContact& contact : problem.contacts) {
    length_ += contact.r_a_W.norm() + contact.r_b_W.norm();
    const Scalar turning = std::max(contact.rolling_friction, contact.torsional_friction);
    for (const auto& [index, r_W] :
         {std::pair(contact.body_a, contact.r_a_W), std::pair(contact.body_b, contact.r_b_W)}) {
      if (index < movable) continue;
      const ContactBody& body = problem.bodies[index];
      speed_ = std::max({speed_, (body.free_v_W + body.free_w_W.cross(r_W)).norm(),
                         turning * body.free_w_W.norm()});
    }
  }
  length_ /= 2 * std::max(Scalar(problem.contacts.size()), Scalar{1});
  if (!(speed_ > 0)) return;  // nothing moves that could be blocked
  for (const PointContact& contact : problem.contacts) {
    // A target below zero asks for no work.
    speed_ = std::max({speed_, contact.target, contact.sticking_velocity_W.norm()});
  }
}

// The velocities that the impulse gives to the bodies that can be moved, as if all were alike:
// locked axes take none. Below them what it takes from the others, in units of speed_.
Generator StressSearch::column_of(std::size_t a, std::size_t b, const Vector3& j_av_W,
                                  const Vector3& j_aw_W, const Vector3& j_bv_W,
                                  const Vector3& j_bw_W) const {
  Generator result;
  result.column = Eigen::VectorXd::Zero(Eigen::Index(6 * movable_ + 1));
  const auto act = [&](std::size_t index, const Vector3& j_v_W, const Vector3& j_w_W) {
    const ContactBody& body = problem_.bodies[index];
    if (index >= movable_) {
      result.prescribed_work += (j_v_W.dot(body.free_v_W) + j_w_W.dot(body.free_w_W)) / speed_;
      return;
    }
    const auto row = Eigen::Index(6 * index);
    if (stiffest_linear_[index] > 0) {
      result.column.segment<3>(row) += body.inverse_mass_W * j_v_W / stiffest_linear_[index];
    }
    if (stiffest_angular_[index] > 0) {
      result.column.segment<3>(row + 3) +=
          body.inverse_inertia_W * j_w_W / (stiffest_angular_[index] * length_);
    }
  };
  act(a, j_av_W, j_aw_W);
  act(b, j_bv_W, j_bw_W);
  result.column[result.column.size() - 1] = result.prescribed_work;
  return result;
}

Generator StressSearch::impulse_at(std::size_t contact, const Vector3& impulse_W,
                                   const Vector3& angular_W) const {
  const PointContact& entry = problem_.contacts[contact];
  Generator result =
      column_of(entry.body_a, entry.body_b, -impulse_W, -entry.r_a_W.cross(impulse_W) - angular_W,
                impulse_W, entry.r_b_W.cross(impulse_W) + angular_W);
  result.index = contact;
  result.impulse_W = impulse_W;
  result.angular_W = angular_W;
  const Vector3 wanted_W = entry.target * entry.nhat_AB_W + entry.sticking_velocity_W;
  result.column[result.column.size() - 1] -= wanted_W.dot(impulse_W) / speed_;
  return result;
}

Generator StressSearch::impulse_of_row(std::size_t row, Scalar sign) const {
  const JointRow& entry = problem_.rows[row];
  Generator result = column_of(entry.body_a, entry.body_b, sign * entry.j_av_W, sign * entry.j_aw_W,
                               sign * entry.j_bv_W, sign * entry.j_bw_W);
  result.index = row;
  result.sign = sign;
  return result;
}

// Where in the cone of a contact the residual falls fastest. A column is linear in its impulse.
Generator StressSearch::steepest(std::size_t contact) const {
  const PointContact& entry = problem_.contacts[contact];
  const Vector3& n = entry.nhat_AB_W;
  const auto unit_across = [&](const Vector3& v) {
    const Vector3 across = v - n * n.dot(v);
    const Scalar length = across.norm();
    return length > 0 ? Vector3(across / length) : Vector3::Zero();
  };
  Vector3 gradient, turning = Vector3::Zero();
  const bool resists_turning = entry.rolling_friction > 0 || entry.torsional_friction > 0;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Vector3 axis = Vector3::Unit(k);
    gradient[k] = impulse_at(contact, axis, Vector3::Zero()).column.dot(fit_.residual());
    if (!resists_turning) continue;
    turning[k] = impulse_at(contact, Vector3::Zero(), axis).column.dot(fit_.residual());
  }
  const Scalar spin = std::copysign(entry.torsional_friction, n.dot(turning));
  return impulse_at(contact, n + friction_of(problem_, entry) * unit_across(gradient),
                    entry.rolling_friction * unit_across(turning) + spin * n);
}

// Returns whether some impulse in the cones has made the residual smaller.
bool StressSearch::add_best() {
  std::optional<Generator> best;
  Scalar most = kLeastImbalance * fit_.residual().norm();
  const auto consider = [&](Generator candidate) {
    const Scalar norm = candidate.column.norm();
    if (!(candidate.column.dot(fit_.residual()) > most * norm)) return;
    most = candidate.column.dot(fit_.residual()) / norm;
    best = std::move(candidate);
  };
  for (std::size_t i = 0; i < problem_.contacts.size(); ++i) consider(steepest(i));
  for (std::size_t i = 0; i < problem_.rows.size(); ++i) {
    const JointRow& row = problem_.rows[i];
    if (row.compliance > 0) continue;
    if (row.upper == kInfinity) consider(impulse_of_row(i, 1));
    if (row.lower == -kInfinity) consider(impulse_of_row(i, -1));
  }
  if (!best) return false;
  tried_.push_back(std::move(*best));
  return fit_.add(tried_.back().column, tried_.size() - 1);
}

bool StressSearch::find(Scalar imbalance) {
  if (!(speed_ > 0 && length_ > 0)) return false;
  for (int k = 0; k < kMostColumns; ++k) {
    if (!add_best()) return false;
    if (fit_.residual().norm() < std::max(kLeastImbalance, imbalance)) return true;
  }
  return false;
}

SelfStress StressSearch::stress() const {
  SelfStress result;
  result.impulses_W.resize(problem_.contacts.size(), Vector3::Zero());
  result.angular_impulses_W.resize(problem_.contacts.size(), Vector3::Zero());
  result.row_impulses.resize(problem_.rows.size(), 0);
  std::vector<Scalar> work(problem_.contacts.size(), 0);
  for (const NonnegativeFit::Column& column : fit_.columns()) {
    const Generator& used = tried_[column.number];
    const Scalar weight = column.weight;
    if (used.sign) {
      result.row_impulses[used.index] += weight * *used.sign;
    } else {
      result.impulses_W[used.index] += weight * used.impulse_W;
      result.angular_impulses_W[used.index] += weight * used.angular_W;
      work[used.index] += weight * used.prescribed_work;
    }
  }
  result.hardest_contact =
      static_cast<std::size_t>(std::min_element(work.begin(), work.end()) - work.begin());
  return result;
}

}  // namespace

std::optional<SelfStress> find_self_stress(const ContactProblem& problem, std::size_t movable,
                                           Scalar imbalance) {
  if (movable > kMostBodies) return std::nullopt;
  StressSearch search(problem, movable);
  if (!search.find(imbalance)) return std::nullopt;
  return search.stress();
}

}  // namespace dyop::dynamics_internal
