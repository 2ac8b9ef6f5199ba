// SPDX-License-Identifier: BSD-3-Clause
#include "contact/solver/interior_point_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "contact/solver/contact_law.h"
#include "core/tolerance.h"

namespace dyop::contact_internal {

Scalar cone_determinant(const Vector3& x) {
  const Scalar t = x.tail<2>().norm();
  return (x[0] - t) * (x[0] + t);
}

Vector3 cone_product(const Vector3& a, const Vector3& b) {
  return {a.dot(b), a[0] * b[1] + b[0] * a[1], a[0] * b[2] + b[0] * a[2]};
}

Vector3 cone_quotient(const Vector3& a, const Vector3& b) {
  const Scalar x = (a[0] * b[0] - a.tail<2>().dot(b.tail<2>())) / cone_determinant(a);
  return {x, (b[1] - x * a[1]) / a[0], (b[2] - x * a[2]) / a[0]};
}

Scalar way_to_cone(const Vector3& x, const Vector3& d) {
  const Scalar c = cone_determinant(x);
  const Scalar b = x[0] * d[0] - x.tail<2>().dot(d.tail<2>());
  const Scalar a = d[0] * d[0] - d.tail<2>().squaredNorm();
  Scalar way = d[0] < 0 ? -x[0] / d[0] : kInfinity;
  // Roots of a s^2 + 2 b s + c, without cancellation.
  const Scalar discriminant = b * b - a * c;
  if (!(discriminant >= 0)) return way;
  const Scalar root = std::sqrt(discriminant);
  const Scalar q = b >= 0 ? -(b + root) : root - b;
  for (const Scalar s : {q / a, c / q}) {
    if (s > 0 && s < way) way = s;
  }
  return way;
}

ConeScaling::ConeScaling(const Vector3& z, const Vector3& x) {
  constexpr Scalar kLeast = std::numeric_limits<Scalar>::min();  // rounding may leave the cone
  const Scalar size_z = std::sqrt(std::max(cone_determinant(z), kLeast));
  const Scalar size_x = std::sqrt(std::max(cone_determinant(x), kLeast));
  const Scalar gain = std::sqrt(size_z / size_x);
  Vector3 w = z / size_z;
  w[0] += x[0] / size_x;
  w.tail<2>() -= x.tail<2>() / size_x;
  w /= std::sqrt(2 * (1 + z.dot(x) / (size_z * size_x)));  // determinant one
  const Vector2 t = w.tail<2>();
  const Eigen::Matrix2d block = Eigen::Matrix2d::Identity() + t * t.transpose() / (1 + w[0]);
  W << w[0], t.transpose(), t, block;
  inverse << w[0], -t.transpose(), -t, block;
  W *= gain;
  inverse /= gain;
  middle = W * x;
}

namespace {

// Part of the way to the edge of the cones that a step goes at most: the first far from the
// solution, the second near it, where products have become small.
constexpr Scalar kNearlyAll = 0.9;
constexpr Scalar kAllButAll = 0.999;
// Fewer factorisations are the rule; more mean that something contradicts the hypothesis.
constexpr int kRestingLimit = 25;
// The shift is the rest of the residual if the one without it is smaller than this part.
constexpr Scalar kSlidingPart = 0.1;
// Near the solution, at so small a part of the residual without impulses, a step this short has met
// the contradictions of redundant contacts, which Newton resolves better. All found by measurement.
constexpr Scalar kShortStep = 0.3;
constexpr Scalar kNearPart = 1e-6;  // literal: a ratio of residuals
// Limit on Newton's factorisations afterwards: most need a few.
constexpr int kPolishLimit = 25;
// Impulses with a larger part of it answer another question, and are a bad start for the others.
constexpr Scalar kKeptPart = 1e-5;  // literal: a ratio of residuals

Vector3 moved_inside(Vector3 x, Scalar by) {
  x[0] = std::max(x[0], x.tail<2>().norm()) + by;
  return x;
}

}  // namespace

void InteriorPointSolver::list_pairs() {
  const std::vector<Block>& blocks = system_->blocks();
  pair_of_block_.clear();
  std::size_t count = 0;
  std::size_t rows = 0;
  for (const Block& block : blocks) {
    pair_of_block_.push_back(block.kind == BlockKind::Contact ? count++ : kNoPair);
    if (block.kind == BlockKind::Row) ++rows;
  }
  pairs_.resize(count);
  rows_.resize(rows);
  system_->loops().each(blocks.size(), [&](std::size_t i) {
    if (pair_of_block_[i] != kNoPair) pairs_[pair_of_block_[i]].block = i;
  });
}

// The starting impulses, moved inside the cones and bounds by as much as they violate the laws.
void InteriorPointSolver::begin(ContactSystem& system) {
  system_ = &system;
  system.update_velocities();
  y_ = system.velocities();
  step_.resize(y_.size());
  matrix_.analyse(system);
  list_pairs();
  const std::vector<Block>& blocks = system.blocks();
  const SharedLoops& loops = system.loops();
  start_lambda_.resize(blocks.size());
  loops.each(blocks.size(), [&](std::size_t i) { start_lambda_[i] = blocks[i].lambda; });
  best_lambda_ = start_lambda_;
  best_residual_ = loops.largest(blocks.size(), [&](std::size_t i) {
    return blocks[i].owner < 0 ? system.residual(blocks[i]) : 0;
  });
  loops.each(pairs_.size(), [&](std::size_t i) { begin_pair(pairs_[i]); });
  products_ = pairs_.size();
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    rows_[i].begin(blocks[i], i, system.relative_velocity(blocks[i])[0], best_residual_);
    products_ += std::size_t(rows_[i].bounds());
  }
}

void InteriorPointSolver::begin_pair(Pair& pair) const {
  const Block& block = system_->blocks()[pair.block];
  const Scalar mu = block.friction;
  pair.scale = mu > 0 ? Vector3(1 / mu, 1, 1) : Vector3(1, 0, 0);
  const Vector3 impulse =
      mu > 0 ? Vector3(mu * block.lambda[0], block.lambda[1], block.lambda[2]) : block.lambda;
  pair.impulse = moved_inside(impulse, best_residual_ / block.weight);
  Vector3 velocity = pair.scale.cwiseProduct(system_->relative_velocity(block));
  if (has_shift_) velocity[0] += velocity.tail<2>().norm();
  pair.velocity = moved_inside(velocity, best_residual_);
}

// The shift of a scaled velocity is its tangential length, whatever the coefficient.
void InteriorPointSolver::measure_gap(Pair& pair) const {
  const Block& block = system_->blocks()[pair.block];
  pair.gap = pair.scale.cwiseProduct(block.free + velocity_of(block, y_)) - pair.velocity;
  pair.along.setZero();
  if (!has_shift_) return;
  const Scalar sliding = pair.velocity.tail<2>().norm();
  if (sliding > 0) pair.along = pair.velocity.tail<2>() / sliding;
  pair.gap[0] += sliding + pair.along.dot(pair.gap.tail<2>());
}

void InteriorPointSolver::find_way(Pair& pair) const {
  pair.way = way_to_cone(pair.impulse, pair.impulse_step);
  if (!has_shift_) {
    pair.way = std::min(pair.way, way_to_cone(pair.velocity, pair.velocity_step));
  } else if (pair.room_step() < 0) {
    pair.way = std::min(pair.way, -pair.room() / pair.room_step());
  }
}

void InteriorPointSolver::go(Pair& pair, Scalar step) const {
  const Scalar room = pair.room() + step * pair.room_step();
  pair.impulse += step * pair.impulse_step;
  pair.velocity += step * pair.velocity_step;
  if (has_shift_) pair.velocity[0] = room + pair.velocity.tail<2>().norm();
}

void InteriorPointSolver::evaluate() {
  const SharedLoops& loops = system_->loops();
  std::vector<Block>& blocks = system_->blocks();
  loops.each(pairs_.size(), [&](std::size_t i) {
    Pair& pair = pairs_[i];
    Block& block = blocks[pair.block];
    block.lambda = pair.scale.cwiseProduct(pair.impulse);
    measure_gap(pair);
  });
  for (RowBarrier& row : rows_) {
    Block& block = blocks[row.block()];
    block.lambda[0] = row.impulse();
    row.set_velocity(block.free[0] + velocity_of(block, y_)[0] + block.compliance * row.impulse());
  }
  lacking_.resize(y_.size());
  for (std::size_t i = 0; i < y_.size(); ++i) lacking_[i] = -y_[i];
  system_->add_impulses(lacking_, [&](std::size_t i) { return blocks[i].lambda; });
  product_ = loops.sum(0, pairs_.size(), [&](std::size_t i) {
    return pairs_[i].impulse.dot(pairs_[i].velocity) / Scalar(products_);
  });
  for (const RowBarrier& row : rows_) product_ += row.product() / Scalar(products_);
  system_->update_velocities();
}

void InteriorPointSolver::measure() {
  const SharedLoops& loops = system_->loops();
  const std::vector<Block>& blocks = system_->blocks();
  held_residual_ = loops.largest(blocks.size(), [&](std::size_t i) {
    const Block& block = blocks[i];
    if (block.owner >= 0) return Scalar{0};
    const Vector3 x = block.lambda - system_->relative_velocity(block) / block.weight;
    return (block.lambda - project(block, x, 0)).norm() * block.weight;
  });
  residual_ = loops.largest(blocks.size(), [&](std::size_t i) {
    return blocks[i].owner < 0 ? system_->residual(blocks[i]) : 0;
  });
  if (!(residual_ < best_residual_)) return;
  best_residual_ = residual_;
  loops.each(blocks.size(), [&](std::size_t i) { best_lambda_[i] = blocks[i].lambda; });
}

bool InteriorPointSolver::factorise() {
  const SharedLoops& loops = system_->loops();
  loops.each(pairs_.size(), [&](std::size_t i) {
    Pair& pair = pairs_[i];
    pair.scaling = ConeScaling(pair.velocity, pair.impulse);
    const Matrix3 root = pair.scaling.inverse * pair.scale.asDiagonal();
    pair.stiffness.noalias() = root.transpose() * root;
    if (!has_shift_) return;
    const Vector3 by_shift = pair.stiffness.col(0) / pair.scale[0];
    pair.stiffness.rightCols<2>() += by_shift * pair.along.transpose();
  });
  for (RowBarrier& row : rows_) row.linearise();
  matrix_.reset(!has_shift_);
  const Matrix3 none = Matrix3::Zero();
  matrix_.add_all(*system_, [&](std::size_t i) -> const Matrix3& {
    if (i < rows_.size()) return rows_[i].stiffness();
    return pair_of_block_[i] == kNoPair ? none : pairs_[pair_of_block_[i]].stiffness;
  });
  return matrix_.factorise(loops);
}

// The steps that change the scaled products by `wanted`, and close all gaps.
void InteriorPointSolver::solve() {
  const SharedLoops& loops = system_->loops();
  loops.each(pairs_.size(), [&](std::size_t i) {
    Pair& pair = pairs_[i];
    const ConeScaling& scaling = pair.scaling;
    pair.wanted = cone_quotient(scaling.middle, pair.wanted);
    pair.impulse_step =
        pair.scale.cwiseProduct(scaling.inverse * (pair.wanted - scaling.inverse * pair.gap));
  });
  step_ = lacking_;
  for (RowBarrier& row : rows_) row.set_impulse_step();
  system_->add_impulses(step_, [&](std::size_t i) -> Vector3 {
    if (i < rows_.size()) return {rows_[i].impulse_step(), 0, 0};
    return pair_of_block_[i] == kNoPair ? Vector3(Vector3::Zero())
                                        : pairs_[pair_of_block_[i]].impulse_step;
  });
  matrix_.solve(step_, system_->loops());
  loops.each(pairs_.size(), [&](std::size_t i) {
    Pair& pair = pairs_[i];
    const ConeScaling& scaling = pair.scaling;
    pair.velocity_step =
        pair.scale.cwiseProduct(velocity_of(system_->blocks()[pair.block], step_)) + pair.gap;
    const Vector2 sliding = pair.velocity_step.tail<2>() - pair.gap.tail<2>();
    pair.velocity_step[0] += pair.along.dot(sliding);
    pair.impulse_step = scaling.inverse * (pair.wanted - scaling.inverse * pair.velocity_step);
    find_way(pair);
  });
  longest_step_ = kInfinity;
  for (const Pair& pair : pairs_) longest_step_ = std::min(longest_step_, pair.way);
  for (RowBarrier& row : rows_) {
    row.take_step(velocity_of(system_->blocks()[row.block()], step_)[0]);
    longest_step_ = std::min(longest_step_, row.way());
  }
}

// The predictor aims at products of zero. What it reaches says how far to aim now; its products are
// the error of linearising.
void InteriorPointSolver::predict_and_correct() {
  const SharedLoops& loops = system_->loops();
  loops.each(pairs_.size(), [&](std::size_t i) {
    const Vector3& middle = pairs_[i].scaling.middle;
    pairs_[i].wanted = -cone_product(middle, middle);
  });
  for (RowBarrier& row : rows_) row.aim_at_zero();
  solve();
  const Scalar way = std::min(longest_step_, Scalar{1});
  Scalar predicted = loops.sum(0, pairs_.size(), [&](std::size_t i) {
    const Pair& pair = pairs_[i];
    return (pair.impulse + way * pair.impulse_step).dot(pair.velocity + way * pair.velocity_step) /
           Scalar(products_);
  });
  for (const RowBarrier& row : rows_) predicted += row.product_after(way) / Scalar(products_);
  const Scalar part = product_ > 0 ? std::max(predicted, Scalar{0}) / product_ : 0;
  for (RowBarrier& row : rows_) row.aim_at(part * part * part * product_);
  loops.each(pairs_.size(), [&](std::size_t i) {
    Pair& pair = pairs_[i];
    const Vector3& v = pair.scaling.middle;
    pair.wanted = -cone_product(v, v) - cone_product(pair.scaling.W * pair.impulse_step,
                                                     pair.scaling.inverse * pair.velocity_step);
    pair.wanted[0] += part * part * part * product_;
  });
  solve();
}

bool InteriorPointSolver::keeps_going(Scalar before, Scalar step) const {
  if (has_shift_) return std::isfinite(residual_);
  if (!(held_residual_ > kSlidingPart * residual_)) return false;  // also NaN
  if (held_residual_ > kNearPart * system_->residual_without_impulses()) return true;
  return step > kShortStep || held_residual_ < before / 2;
}

void InteriorPointSolver::improve(ContactSystem& system, const ContactSolverOptions& options,
                                  ContactReport& report, Sliding sliding) {
  if (options.newton_limit == 0 || system.blocks().empty()) return;
  has_shift_ = sliding == Sliding::Any;
  begin(system);
  Scalar step = 1;
  Scalar before = kInfinity;
  Scalar first_product = 0;
  const int limit = std::min(options.newton_limit, kRestingLimit);
  for (int i = 0;; ++i) {
    evaluate();
    measure();
    if (i == 0) first_product = product_;
    if (best_residual_ <= options.tolerance || i == limit || is_over(options.interrupt)) break;
    if (!keeps_going(before, step)) break;
    before = held_residual_;
    ++report.newton_iterations;
    if (!factorise()) break;
    predict_and_correct();
    const Scalar done = first_product > 0 ? 1 - product_ / first_product : 1;
    const Scalar part = std::clamp(done, kNearlyAll, kAllButAll);
    step = std::min(part * longest_step_, Scalar{1});
    system.loops().each(pairs_.size(), [&](std::size_t k) { go(pairs_[k], step); });
    for (RowBarrier& row : rows_) row.go(step);
    for (std::size_t k = 0; k < y_.size(); ++k) y_[k] += step * step_[k];
  }
  put_back(has_shift_ || best_residual_ <= kKeptPart * system.residual_without_impulses());
  if (has_shift_ && best_residual_ > options.tolerance) polish(options, report);
}

void InteriorPointSolver::polish(const ContactSolverOptions& options, ContactReport& report) {
  const Scalar before = system_->residual();
  report.newton_iterations +=
      newton_.polish(*system_, options, std::min(options.newton_limit, kPolishLimit));
  if (system_->residual() < before) return;
  put_back(true);
}

// Puts the best impulses, or those of the start, into the system, within their bounds.
void InteriorPointSolver::put_back(bool is_kept) {
  const std::vector<Vector3>& kept = is_kept ? best_lambda_ : start_lambda_;
  std::vector<Block>& blocks = system_->blocks();
  for (std::size_t i = 0; i < kept.size(); ++i) blocks[i].lambda = kept[i];
  for (Block& block : blocks) {
    if (block.owner < 0) continue;
    const Scalar bound = blocks[std::size_t(block.owner)].lambda[0];
    block.lambda = project(block, block.lambda, bound);
  }
  // An impulse between two bounds may have been rounded beyond one.
  for (const RowBarrier& row : rows_) {
    Block& block = blocks[row.block()];
    block.lambda = project(block, block.lambda, 0);
  }
  system_->update_velocities();
}

}  // namespace dyop::contact_internal
