// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <vector>

#include "contact/solver/body_matrix.h"
#include "contact/solver/contact_law.h"
#include "contact/solver/contact_sweeps.h"
#include "contact/solver/contact_system.h"
#include "core/assert.h"
#include "dyop/contact/contact_solver.h"

namespace dyop::contact_internal {
namespace {

// Times a row's mobility. Larger: rounding in the factors is felt; smaller: more steps for chains
// of unequal masses.
constexpr Scalar kRowPenalty = 1e8;
constexpr int kMostRowSteps = 12;
// Part of the tolerance that is left to the rows.
constexpr Scalar kRowGoal = 0.1;
// The residual is measured after a sweep that changed velocities by at most so many tolerances: as
// a rule it is a tenth of that. Larger: it is measured in vain, at a third of the cost of a sweep.
constexpr Scalar kNearChange = 30;

}  // namespace

// Rows of joints without bounds, solved all at once for given impulses of the others, in time
// linear in the bodies of a tree: by the method of multipliers with so large a penalty that a few
// steps with one factorisation do, however unequal the masses are; where rows repeat each other it
// gives impulses that change least.
class FreeRows {
 public:
  // Returns whether there are any.
  bool begin(const ContactSystem& system);
  static bool is_free(const Block& block) {
    return block.kind == BlockKind::Row && block.lower == -kInfinity && block.upper == kInfinity;
  }
  // Changes their impulses and all velocities until their velocities are below `goal`, or rounding
  // is reached.
  void solve(ContactSystem& system, Scalar goal);

 private:
  Scalar measure(const ContactSystem& system);
  void step(ContactSystem& system);

  BodyMatrix matrix_;
  std::vector<std::size_t> rows_;
  std::vector<Scalar> penalty_, u_;  // by row
  std::vector<Vector6> change_;
};

bool FreeRows::begin(const ContactSystem& system) {
  rows_.clear();
  penalty_.clear();
  const std::vector<Block>& blocks = system.blocks();
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (!is_free(blocks[i])) continue;
    const Scalar penalty = kRowPenalty / blocks[i].weight;
    rows_.push_back(i);
    penalty_.push_back(penalty / (1 + penalty * blocks[i].compliance));
  }
  if (rows_.empty()) return false;
  u_.resize(rows_.size());
  change_.resize(system.velocities().size());
  matrix_.analyse(system, rows_.back() + 1);
  matrix_.reset();
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    matrix_.add(system, rows_[k], Vector3(penalty_[k], 0, 0).asDiagonal());
  }
  if (!matrix_.factorise(system.loops())) rows_.clear();
  return !rows_.empty();
}

Scalar FreeRows::measure(const ContactSystem& system) {
  Scalar largest = 0;
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    u_[k] = system.relative_velocity(system.blocks()[rows_[k]])[0];
    largest = std::max(largest, std::abs(u_[k]));
  }
  return largest;
}

// Minimises 1/2 |change|^2 + sum of penalty / 2 (u + G change)^2; impulses change by -penalty times
// what is left of u.
void FreeRows::step(ContactSystem& system) {
  std::vector<Block>& blocks = system.blocks();
  for (Vector6& change : change_) change.setZero();
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    add_impulse(blocks[rows_[k]], Vector3(-penalty_[k] * u_[k], 0, 0), change_);
  }
  matrix_.solve(change_, system.loops());
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    Block& block = blocks[rows_[k]];
    const Vector3 impulse(-penalty_[k] * (u_[k] + velocity_of(block, change_)[0]), 0, 0);
    block.lambda += impulse;
    add_impulse(block, impulse, system.velocities());
  }
}

void FreeRows::solve(ContactSystem& system, Scalar goal) {
  Scalar before = measure(system);
  for (int i = 0; i < kMostRowSteps && before > goal; ++i) {
    step(system);
    const Scalar now = measure(system);
    if (!(now <= before / 2)) break;
    before = now;
  }
}

}  // namespace dyop::contact_internal

namespace dyop {

using contact_internal::Block;
using contact_internal::BlockKind;
using contact_internal::ContactSweeps;
using contact_internal::ContactSystem;
using contact_internal::FreeRows;
using contact_internal::Vector6;

struct GaussSeidelSolver::Memory {
  ContactSweeps sweeps;
  FreeRows rows;
  // Values before the sweep, and the conjugate directions, of impulses and velocities.
  std::vector<Vector3> old_lambda, step_lambda;
  std::vector<Vector6> old_y, step_y;
  Scalar old_gradient_sq = 0;

  void begin(const ContactSystem& system);
  void keep(const ContactSystem& system);
  void accelerate(ContactSystem& system);
};

void GaussSeidelSolver::Memory::begin(const ContactSystem& system) {
  old_lambda.resize(system.blocks().size());
  step_lambda.assign(system.blocks().size(), Vector3::Zero());
  old_y.resize(system.velocities().size());
  step_y.assign(system.velocities().size(), Vector6::Zero());
  old_gradient_sq = 0;
}

void GaussSeidelSolver::Memory::keep(const ContactSystem& system) {
  for (std::size_t i = 0; i < old_lambda.size(); ++i) old_lambda[i] = system.blocks()[i].lambda;
  std::copy(system.velocities().begin(), system.velocities().end(), old_y.begin());
}

// The change over a sweep acts as the gradient in a nonlinear conjugate gradient iteration
// (Fletcher-Reeves); when it grows, the direction is dropped.
void GaussSeidelSolver::Memory::accelerate(ContactSystem& system) {
  std::vector<Block>& blocks = system.blocks();
  std::vector<Vector6>& y = system.velocities();
  Scalar gradient_sq = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    gradient_sq += blocks[i].weight * (blocks[i].lambda - old_lambda[i]).squaredNorm();
  }
  const Scalar beta = old_gradient_sq > 0 ? gradient_sq / old_gradient_sq : 0;
  old_gradient_sq = gradient_sq;
  const bool is_restart = !(beta <= 1);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const Vector3 change = blocks[i].lambda - old_lambda[i];
    if (is_restart) {
      step_lambda[i].setZero();
    } else {
      blocks[i].lambda += beta * step_lambda[i];
      step_lambda[i] = beta * step_lambda[i] + change;
    }
  }
  for (std::size_t i = 0; i < y.size(); ++i) {
    const Vector6 change = y[i] - old_y[i];
    if (is_restart) {
      step_y[i].setZero();
    } else {
      y[i] += beta * step_y[i];
      step_y[i] = beta * step_y[i] + change;
    }
  }
}

namespace {

// The impulse that solves the block's law with all others fixed.
Vector3 solve_block(Block& block, const Vector3& u, Scalar normal) {
  switch (block.kind) {
    case BlockKind::Contact:
      return block.local.solve(u - block.W * block.lambda, block.friction, block.slip);
    case BlockKind::Row:
    case BlockKind::Torsion:
      return contact_internal::project(block, block.lambda - u / block.weight, normal);
    case BlockKind::Rolling: {
      const Eigen::Matrix2d W = block.W.topLeftCorner<2, 2>();
      const Vector2 q = u.head<2>() - W * block.lambda.head<2>();
      const Vector2 p = contact_internal::solve_disc(W, q, normal, block.slip);
      return {p[0], p[1], 0};
    }
  }
  return block.lambda;  // not reached
}

// Solves one block; returns by how much its velocity changed.
Scalar relax(ContactSystem& system, Block& block) {
  DYOP_ASSERT(block.owner < int(system.blocks().size()), block.owner);
  const Vector3 u = system.relative_velocity(block);
  const Scalar normal = block.owner >= 0 ? system.blocks()[std::size_t(block.owner)].lambda[0] : 0;
  const Vector3 lambda = solve_block(block, u, normal);
  const Vector3 change = lambda - block.lambda;
  block.lambda = lambda;
  contact_internal::add_impulse(block, change, system.velocities());
  return block.weight * change.norm();
}

// All blocks forward and back; without the free rows if `skips_rows`.
Scalar sweep(ContactSystem& system, bool skips_rows) {
  std::vector<Block>& blocks = system.blocks();
  Scalar change = 0;
  const auto visit = [&](Block& block) {
    if (skips_rows && FreeRows::is_free(block)) return;
    change = std::max(change, relax(system, block));
  };
  for (Block& block : blocks) visit(block);
  for (auto block = blocks.rbegin(); block != blocks.rend(); ++block) visit(*block);
  return change;
}

void sweep_contacts(ContactSweeps& sweeps, int limit, const ContactSolverOptions& options,
                    ContactReport& report) {
  for (int i = 0; i < limit && !is_over(options.interrupt); ++i) {
    ++report.sweeps;
    const Scalar change = sweeps.sweep();
    const bool is_near = change <= contact_internal::kNearChange * options.tolerance;
    if (is_near && sweeps.residual() <= options.tolerance) return;
    if (i + 1 < limit) sweeps.accelerate();
  }
}

}  // namespace

GaussSeidelSolver::GaussSeidelSolver() : memory_(std::make_unique<Memory>()) {}
GaussSeidelSolver::~GaussSeidelSolver() = default;

void GaussSeidelSolver::improve(ContactSystem& system, const ContactSolverOptions& options,
                                ContactReport& report) {
  const bool is_small = int(system.blocks().size()) <= options.few_contacts;
  const int limit = is_small ? options.few_sweep_limit : options.sweep_limit;
  if (memory_->sweeps.begin(system)) {
    sweep_contacts(memory_->sweeps, limit, options, report);
    memory_->sweeps.write(system);
    return;
  }
  memory_->begin(system);
  FreeRows& rows = memory_->rows;
  // Not beside contacts: where their loads are not determined, as of jaws that hold something, rows
  // that are relaxed one by one share them more evenly.
  const bool has_rows = !system.has_contacts() && rows.begin(system);
  for (int i = 0; i < limit && !is_over(options.interrupt); ++i) {
    ++report.sweeps;
    memory_->keep(system);
    const Scalar change = sweep(system, has_rows);
    if (has_rows) rows.solve(system, contact_internal::kRowGoal * options.tolerance);
    const bool is_near = change <= contact_internal::kNearChange * options.tolerance;
    if (is_near && system.residual() <= options.tolerance) return;
    if (i + 1 < limit) memory_->accelerate(system);
  }
}

}  // namespace dyop
