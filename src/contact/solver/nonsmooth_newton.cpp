// SPDX-License-Identifier: BSD-3-Clause
#include "contact/solver/nonsmooth_newton.h"

#include <algorithm>
#include <cmath>

#include "contact/solver/contact_law.h"
#include "core/tolerance.h"

namespace dyop::contact_internal {
namespace {

// rho times the trace of a block's mobility. From 3 to 10 about as many problems are solved, in as
// few steps; found by measurement.
constexpr Scalar kStepSize = 5;
// How much a step yields where a contact sticks: with redundant contacts the matrix would be
// singular without it. Ten times larger or smaller at first, fewer problems are solved.
constexpr Scalar kSoftness = 1e-3;
constexpr Scalar kLeastSoftness = 1e-7;  // literal: far above rounding
constexpr Scalar kPolishSoftness = 1e-5;
// From the third step on, an error that hardly changes means that redundant contacts which contradict
// one another pass their load on little by little: so many times stiffer, they do it sooner.
constexpr int kFirstSteps = 2;
constexpr Scalar kSteadyDown = 0.9;
constexpr Scalar kSteadyUp = 1.01;
constexpr Scalar kStiffer = 0.1;
// With joints, contacts become stiffer by this factor at every step, until they yield by only this
// part of the tolerance.
constexpr Scalar kSharingStiffer = 0.01;
constexpr Scalar kSharingPart = 0.1;
// Limit on the factorisations, and how many of them must halve the error. Found by measurement.
constexpr int kLimit = 25;
constexpr int kPatience = 12;

}  // namespace

void NonsmoothNewton::begin(ContactSystem& system) {
  system_ = &system;
  laws_.resize(system.blocks().size());
  y_step_.resize(system.velocities().size());
  matrix_.analyse(system);
  system.update_velocities();
  least_error_ = kInfinity;
  evaluate();
}

// Measures how far the impulses are from their laws.
void NonsmoothNewton::evaluate() {
  const std::vector<Block>& blocks = system_->blocks();
  const SharedLoops& loops = system_->loops();
  error_ = std::sqrt(loops.largest(blocks.size(), [&](std::size_t i) { return measure(i); }));
  if (!(error_ < least_error_)) return;
  least_error_ = error_;
  loops.each(blocks.size(), [&](std::size_t i) { laws_[i].best = blocks[i].lambda; });
}

// The square of one block's error.
Scalar NonsmoothNewton::measure(std::size_t i) {
  const Block& block = system_->blocks()[i];
  Law& law = laws_[i];
  const Scalar kept = shares_loads_ ? 1 - softness_ : Scalar{1};
  law.u = system_->relative_velocity(block);
  const Scalar rho = kStepSize / block.weight;
  law.raw = kept * block.lambda - rho * law.u;
  if (block.kind == BlockKind::Contact) {
    law.raw[0] -= rho * block.friction * tangent_length(law.u);
  }
  law.missing = project(block, law.raw, radius_of(block)) - block.lambda;
  return law.missing.squaredNorm() / (rho * rho);
}

// With D the derivative of P, B that of u~ by u, and c the compliance, the step of lambda solves
//   step = missing + D ((1 - softness) step - rho (B du + c step)) + d dr.
// r, the bound of rolling and torsional friction, is the normal impulse of their contact, and d what
// P changes with it: where the bound is met, the direction.
void NonsmoothNewton::linearise(const Block& block, Law& law) const {
  const Scalar rho = kStepSize / block.weight;
  const Matrix3 D = project_derivative(block, law.raw, radius_of(block));
  law.along.setZero();
  if (block.owner >= 0) {
    const Scalar length = law.raw.norm();
    if (length > radius_of(block)) law.along = law.raw / length;
  }
  if (D.isZero(0)) {
    law.gain.setIdentity();
    law.stiffness.setZero();
    return;
  }
  Matrix3 own = Matrix3::Identity() - (1 - softness_) * D;
  own.col(0) += rho * block.compliance * D.col(0);
  law.gain = own.inverse();
  if (block.owner >= 0) law.along = law.gain * law.along;
  Matrix3 slope = rho * D;
  const Scalar sliding = tangent_length(law.u);
  if (block.kind == BlockKind::Contact && sliding > 0) {
    slope.col(1) += block.friction * law.u[1] / sliding * slope.col(0);
    slope.col(2) += block.friction * law.u[2] / sliding * slope.col(0);
  }
  law.stiffness = law.gain * slope;
}

// Puts the linearised laws into the matrix and the right-hand side, see step().
void NonsmoothNewton::assemble() {
  const std::vector<Block>& blocks = system_->blocks();
  system_->loops().each(blocks.size(), [&](std::size_t i) {
    Law& law = laws_[i];
    linearise(blocks[i], law);
    law.step = law.gain * law.missing;
  });
  matrix_.reset(false);
  matrix_.add_all(*system_, [&](std::size_t i) -> const Matrix3& { return laws_[i].stiffness; });
  for (Vector6& y : y_step_) y.setZero();
  system_->add_impulses(y_step_, [&](std::size_t i) -> Vector3 {
    const Law& law = laws_[i];
    if (law.along.isZero(0)) return law.step;
    return law.step + owner_of(i).step[0] * law.along;
  });
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (laws_[i].along.isZero(0)) continue;
    const auto owner = std::size_t(blocks[i].owner);  // an earlier block
    matrix_.add_between(*system_, i, laws_[i].along, owner, laws_[owner].stiffness.row(0));
  }
}

// du = G dy and dy = sum of G^T times the steps of lambda. Returns false without a solution.
bool NonsmoothNewton::step() {
  std::vector<Block>& blocks = system_->blocks();
  const SharedLoops& loops = system_->loops();
  assemble();
  if (!matrix_.factorise(loops)) return false;
  matrix_.solve(y_step_, loops);
  loops.each(blocks.size(), [&](std::size_t i) {
    Law& law = laws_[i];
    law.step -= law.stiffness * velocity_of(blocks[i], y_step_);
    if (law.along.isZero(0)) blocks[i].lambda += law.step;
  });
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    Law& law = laws_[i];
    if (law.along.isZero(0)) continue;
    law.step += owner_of(i).step[0] * law.along;
    blocks[i].lambda += law.step;
  }
  system_->update_velocities();
  return true;
}

void NonsmoothNewton::share_loads(Scalar tolerance) {
  Scalar largest = 0;  // velocity that yields to an impulse with softness one
  for (const Block& block : system_->blocks()) {
    largest = std::max(largest, block.lambda.norm() * block.weight / kStepSize);
  }
  const Scalar least = largest > 0 ? kSharingPart * tolerance / largest : kSoftness;
  softness_ = std::max(kSharingStiffer * softness_, std::min(least, kSoftness));
}

void NonsmoothNewton::hasten_drift(Scalar before) {
  if (error_ <= kSteadyDown * before || error_ > kSteadyUp * before) return;
  softness_ = std::max(kStiffer * softness_, kLeastSoftness);
}

// Projects the impulses onto their cones. Returns whether they then solve the problem.
bool NonsmoothNewton::settle(Scalar tolerance) {
  std::vector<Block>& blocks = system_->blocks();
  const auto project_one = [&](Block& block) {
    block.lambda = project(block, block.lambda, radius_of(block));
  };
  // Turning follows its contact.
  system_->loops().each(blocks.size(), [&](std::size_t i) {
    if (blocks[i].owner < 0) project_one(blocks[i]);
  });
  for (Block& block : blocks) {
    if (block.owner >= 0) project_one(block);
  }
  system_->update_velocities();
  return system_->residual() <= tolerance;
}

int NonsmoothNewton::run(ContactSystem& system, const ContactSolverOptions& options, int limit) {
  softness_ = kSoftness;
  shares_loads_ = !system.blocks().empty() && system.blocks().front().kind == BlockKind::Row;
  begin(system);
  return iterate(options, limit);
}

int NonsmoothNewton::polish(ContactSystem& system, const ContactSolverOptions& options, int limit) {
  softness_ = kPolishSoftness;
  shares_loads_ = false;
  begin(system);
  return iterate(options, limit);
}

int NonsmoothNewton::iterate(const ContactSolverOptions& options, int limit) {
  Progress progress(least_error_, kPatience);
  limit = std::min(limit, kLimit);
  int used = 0;
  while (used < limit && !progress.has_stalled(used, least_error_) && !is_over(options.interrupt)) {
    ++used;
    const Scalar before = error_;
    if (!step()) break;
    if (shares_loads_) share_loads(options.tolerance);
    evaluate();
    if (!std::isfinite(error_)) break;
    if (!shares_loads_ && used > kFirstSteps) hasten_drift(before);
    if (error_ > options.tolerance) continue;
    if (settle(options.tolerance)) return used;
    evaluate();
  }
  for (std::size_t i = 0; i < laws_.size(); ++i) system_->blocks()[i].lambda = laws_[i].best;
  settle(options.tolerance);
  return used;
}

}  // namespace dyop::contact_internal
