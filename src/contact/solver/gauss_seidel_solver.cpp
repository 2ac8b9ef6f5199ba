// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/contact/gauss_seidel_solver.h"

#include <algorithm>
#include <vector>

#include "contact/solver/contact_law.h"
#include "contact/solver/contact_system.h"
#include "core/assert.h"

namespace dyop {

using contact_internal::Block;
using contact_internal::BlockKind;
using contact_internal::ContactSystem;
using contact_internal::Vector6;

struct GaussSeidelSolver::Memory {
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
      return contact_internal::solve_contact(block.W, u - block.W * block.lambda, block.friction,
                                             block.slip);
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
  std::vector<Vector6>& y = system.velocities();
  if (block.slot_a >= 0) y[std::size_t(block.slot_a)] += block.G_a.transpose() * change;
  if (block.slot_b >= 0) y[std::size_t(block.slot_b)] += block.G_b.transpose() * change;
  return block.weight * change.norm();
}

Scalar sweep(ContactSystem& system) {
  std::vector<Block>& blocks = system.blocks();
  Scalar change = 0;
  for (Block& block : blocks) change = std::max(change, relax(system, block));
  for (auto block = blocks.rbegin(); block != blocks.rend(); ++block) {
    change = std::max(change, relax(system, *block));
  }
  return change;
}

}  // namespace

GaussSeidelSolver::GaussSeidelSolver() : memory_(std::make_unique<Memory>()) {}
GaussSeidelSolver::~GaussSeidelSolver() = default;

void GaussSeidelSolver::improve(ContactSystem& system, const ContactSolverOptions& options,
                                ContactReport& report) {
  const bool is_small = int(system.blocks().size()) <= options.few_contacts;
  const int limit = is_small ? options.few_sweep_limit : options.sweep_limit;
  memory_->begin(system);
  for (int i = 0; i < limit && !is_over(options.interrupt); ++i) {
    ++report.sweeps;
    memory_->keep(system);
    if (sweep(system) <= options.tolerance && system.residual() <= options.tolerance) return;
    if (i + 1 < limit) memory_->accelerate(system);
  }
}

}  // namespace dyop
