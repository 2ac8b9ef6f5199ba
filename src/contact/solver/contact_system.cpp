// SPDX-License-Identifier: BSD-3-Clause
#include "contact/solver/contact_system.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <tuple>
#include <utility>

#include "contact/solver/contact_law.h"
#include "contact/solver/sweep_kernels.h"
#include "core/assert.h"
#include "core/tolerance.h"

namespace dyop::contact_internal {
namespace {

// S with S S^T = M for a positive semidefinite M: Cholesky with the largest pivot first, so that
// what is dropped at the end is rounding of the largest entry.
Matrix3 square_root(Matrix3 M) {
  Matrix3 S = Matrix3::Zero();
  const Scalar least = kContactMobilityNoise * M.diagonal().maxCoeff();
  for (Eigen::Index k = 0; k < 3; ++k) {
    Eigen::Index pivot = 0;
    const Scalar largest = M.diagonal().maxCoeff(&pivot);
    if (!(largest > least)) break;
    S.col(k) = M.col(pivot) / std::sqrt(largest);
    M -= S.col(k) * S.col(k).transpose();
    M.row(pivot).setZero();
    M.col(pivot).setZero();
  }
  return S;
}

// Columns: the normal and two tangents; the first along the ellipse's larger axis, the second
// shortened so that its coefficient is the same.
Matrix3 make_basis(const PointContact& contact) {
  const Vector3 n = contact.nhat_AB_W.normalized();
  Vector3 t = Vector3::Zero();
  if (contact.ellipse) {
    t = contact.ellipse->axis_W - n * n.dot(contact.ellipse->axis_W);
    const Scalar length = t.norm();
    t = length > kContactMobilityNoise * contact.ellipse->axis_W.norm() ? Vector3(t / length)
                                                                        : Vector3::Zero();
  }
  if (t.isZero(0)) t = n.unitOrthogonal();
  Matrix3 basis;
  basis << n, t, n.cross(t);
  if (contact.ellipse && contact.ellipse->across != contact.friction) {
    const Scalar along = contact.friction;
    const Scalar across = contact.ellipse->across;
    if (along >= across) {
      basis.col(2) *= across / along;
    } else {
      basis.col(1) *= along / across;
    }
  }
  return basis;
}

// Whether no impulse changes a block's first component.
bool is_immovable(const Block& block) {
  return !(block.W(0, 0) + block.compliance > kContactMobilityNoise * block.weight);
}

Scalar largest_coefficient(const PointContact& contact) {
  return contact.ellipse ? std::max(contact.friction, contact.ellipse->across) : contact.friction;
}

// The component of an impulse along a column that may have been shortened.
Scalar component(const Vector3& column, const Vector3& impulse_W) {
  const Scalar length_sq = column.squaredNorm();
  return length_sq > 0 ? column.dot(impulse_W) / length_sq : 0;
}

}  // namespace

void ContactSystem::build(const ContactProblem& problem) {
  check_problem(problem, loops_);
  immovable_.clear();
  carried_.clear();
  carried_.reserve(problem.carriers.size());  // blocks point into it
  next_carrier_ = 0;
  build_slots(problem);
  place_blocks(problem);
  for (std::size_t i = 0; i < problem.rows.size(); ++i) make_row(problem, i);
  loops_.each(problem.contacts.size(), [&](std::size_t i) { make_contact(problem, i); });
  set_immovable_apart();
  if (loops_.has_team()) list_shares();
  update_velocities();
}

void ContactSystem::build_slots(const ContactProblem& problem) {
  slot_of_body_.clear();
  int count = 0;
  for (const ContactBody& body : problem.bodies) {
    const bool is_movable = !body.inverse_mass_W.isZero(0) || !body.inverse_inertia_W.isZero(0);
    slot_of_body_.push_back(is_movable ? count++ : -1);
  }
  slots_.resize(std::size_t(count));
  loops_.each(problem.bodies.size(), [&](std::size_t i) {
    if (slot_of_body_[i] < 0) return;
    slots_[std::size_t(slot_of_body_[i])] = {square_root(problem.bodies[i].inverse_mass_W),
                                             square_root(problem.bodies[i].inverse_inertia_W)};
  });
  y_.assign(slots_.size(), Vector6::Zero());
}

void ContactSystem::place_blocks(const ContactProblem& problem) {
  std::size_t next = problem.rows.size();
  place_of_contact_.clear();
  for (const PointContact& contact : problem.contacts) {
    place_of_contact_.push_back(next++);
    if (contact.rolling_friction > 0) ++next;
    if (contact.torsional_friction > 0) ++next;
  }
  blocks_.resize(next);
  sources_.resize(next);
}

void ContactSystem::begin_block(Block& block, BlockKind kind, std::size_t body_a,
                                std::size_t body_b) const {
  DYOP_ASSERT(body_a < slot_of_body_.size() && body_b < slot_of_body_.size(), body_a, ' ', body_b);
  block = {};
  block.kind = kind;
  block.slot_a = slot_of_body_[body_a];
  block.slot_b = slot_of_body_[body_b];
}

// Turns G from rows along v and w into rows along y.
void ContactSystem::to_slot(int slot, Rows6& G) const {
  if (slot < 0) {
    G.setZero();
    return;
  }
  const Slot& body = slots_[std::size_t(slot)];
  G.leftCols<3>() = (G.leftCols<3>() * body.S_v).eval();
  G.rightCols<3>() = (G.rightCols<3>() * body.S_w).eval();
}

void ContactSystem::finish(std::size_t at, const Matrix3& basis_W, std::size_t index) {
  Block& block = blocks_[at];
  to_slot(block.slot_a, block.G_a);
  to_slot(block.slot_b, block.G_b);
  block.W.noalias() = block.G_a * block.G_a.transpose();
  block.W.noalias() += block.G_b * block.G_b.transpose();
  for (const Carried& more : carried_by(block)) block.W.noalias() += more.G * more.G.transpose();
  block.weight = block.W.trace() + block.compliance;
  sources_[at] = {index, basis_W};
  if (is_immovable(block)) {
    block.lambda.setZero();
    std::atomic_ref(has_immovable_).store(true, std::memory_order_relaxed);
  } else if (block.kind == BlockKind::Contact) {
    block.local = LocalContact(block.W);
  }
}

// Turning goes with its contact.
void ContactSystem::set_immovable_apart() {
  if (!std::exchange(has_immovable_, false)) return;
  std::size_t kept = 0;
  bool has_owner = false;  // the last contact
  std::size_t owner = 0;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    const bool is_turning = blocks_[i].owner >= 0;
    if (is_turning && !has_owner) continue;
    const bool is_kept = !is_immovable(blocks_[i]);
    if (!is_turning) has_owner = is_kept;
    if (!is_kept) {
      immovable_.push_back(blocks_[i]);
      continue;
    }
    if (is_turning) {
      blocks_[i].owner = int(owner);
    } else {
      owner = kept;
    }
    if (kept != i) {
      blocks_[kept] = blocks_[i];
      sources_[kept] = sources_[i];
    }
    ++kept;
  }
  blocks_.resize(kept);
  sources_.resize(kept);
}

void ContactSystem::list_shares() {
  first_share_.assign(y_.size() + 1, 0);
  for (const Block& block : blocks_) {
    for (const int slot : {block.slot_a, block.slot_b}) {
      if (slot >= 0) ++first_share_[std::size_t(slot)];
    }
  }
  std::size_t end = 0;
  for (std::size_t& first : first_share_) first = end += first;
  shares_.resize(end);
  // From the last block to the first, so that lists ascend; each list's end becomes its beginning.
  for (std::size_t i = blocks_.size(); i-- > 0;) {
    const auto place = [&](int slot, bool is_a) {
      if (slot < 0) return;
      Share& share = shares_[--first_share_[std::size_t(slot)]];
      share.block = i;
      share.is_a = is_a;
    };
    place(blocks_[i].slot_a, true);
    place(blocks_[i].slot_b, false);
  }
  loops_.each(end, [&](std::size_t i) {
    const Block& block = blocks_[shares_[i].block];
    shares_[i].G = shares_[i].is_a ? block.G_a : block.G_b;
  });
}

void ContactSystem::make_row(const ContactProblem& problem, std::size_t index) {
  const JointRow& row = problem.rows[index];
  const ContactBody& a = problem.bodies[row.body_a];
  const ContactBody& b = problem.bodies[row.body_b];
  Block& block = blocks_[index];
  begin_block(block, BlockKind::Row, row.body_a, row.body_b);
  block.G_a.row(0) << row.j_av_W.transpose(), row.j_aw_W.transpose();
  block.G_b.row(0) << row.j_bv_W.transpose(), row.j_bw_W.transpose();
  block.free[0] = row.j_av_W.dot(a.free_v_W) + row.j_aw_W.dot(a.free_w_W) +
                  row.j_bv_W.dot(b.free_v_W) + row.j_bw_W.dot(b.free_w_W) - row.target;
  block.compliance = row.compliance;
  block.lower = row.lower;
  block.upper = row.upper;
  block.lambda[0] = std::clamp(row.impulse, row.lower, row.upper);
  finish(index, Matrix3::Identity(), index);
}

void ContactSystem::make_contact(const ContactProblem& problem, std::size_t index) {
  const PointContact& contact = problem.contacts[index];
  const ContactBody& a = problem.bodies[contact.body_a];
  const ContactBody& b = problem.bodies[contact.body_b];
  const Matrix3 basis_W = make_basis(contact);
  const std::size_t at = place_of_contact_[index];
  Block& block = blocks_[at];
  begin_block(block, BlockKind::Contact, contact.body_a, contact.body_b);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Vector3 direction = basis_W.col(k);
    block.G_a.row(k) << -direction.transpose(), -contact.r_a_W.cross(direction).transpose();
    block.G_b.row(k) << direction.transpose(), contact.r_b_W.cross(direction).transpose();
    block.lambda[k] = component(direction, contact.impulse_W);
  }
  const Vector3 u_W =
      (b.free_v_W - a.free_v_W) + b.free_w_W.cross(contact.r_b_W) - a.free_w_W.cross(contact.r_a_W);
  block.free = basis_W.transpose() * (u_W - contact.sticking_velocity_W);
  block.free[0] = basis_W.col(0).dot(u_W) - contact.target;
  if (!problem.carriers.empty()) add_carriers(problem, index, basis_W, block);
  block.friction = largest_coefficient(contact);
  block.lambda[0] = std::max(block.lambda[0], Scalar{0});  // contacts cannot pull
  const Scalar bound = block.friction * block.lambda[0];
  const Scalar length = block.lambda.tail<2>().norm();
  if (length > bound) block.lambda.tail<2>() *= bound / length;
  finish(at, basis_W, index);
  std::size_t next = at + 1;
  if (contact.rolling_friction > 0) {
    make_turning(problem, index, basis_W, BlockKind::Rolling, at, next++);
  }
  if (contact.torsional_friction > 0) {
    make_turning(problem, index, basis_W, BlockKind::Torsion, at, next);
  }
}

// Those of the contact are the next ones.
void ContactSystem::add_carriers(const ContactProblem& problem, std::size_t index,
                                 const Matrix3& basis_W, Block& block) {
  const std::size_t first = carried_.size();
  while (next_carrier_ < problem.carriers.size() &&
         problem.carriers[next_carrier_].contact == index) {
    const ContactCarrier& carrier = problem.carriers[next_carrier_++];
    const ContactBody& body = problem.bodies[carrier.body];
    const Scalar sign = carrier.is_of_a ? -1 : 1;
    block.free += sign * (basis_W.transpose() * (body.free_v_W + body.free_w_W.cross(carrier.r_W)));
    Carried more{slot_of_body_[carrier.body], {}};
    if (more.slot < 0) continue;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const Vector3 direction = sign * basis_W.col(k);
      more.G.row(k) << direction.transpose(), carrier.r_W.cross(direction).transpose();
    }
    to_slot(more.slot, more.G);
    carried_.push_back(more);
  }
  block.carriers = int(carried_.size() - first);
  block.carried = carried_.data() + first;
}

void ContactSystem::make_turning(const ContactProblem& problem, std::size_t index,
                                 const Matrix3& basis_W, BlockKind kind, std::size_t owner,
                                 std::size_t at) {
  const PointContact& contact = problem.contacts[index];
  Matrix3 axes_W = Matrix3::Zero();
  if (kind == BlockKind::Rolling) {
    axes_W.col(0) = basis_W.col(0).unitOrthogonal() * contact.rolling_friction;
    axes_W.col(1) = basis_W.col(0).cross(axes_W.col(0));
  } else {
    axes_W.col(0) = basis_W.col(0) * contact.torsional_friction;
  }
  Block& block = blocks_[at];
  begin_block(block, kind, contact.body_a, contact.body_b);
  block.owner = int(owner);
  block.G_a.rightCols<3>() = -axes_W.transpose();
  block.G_b.rightCols<3>() = axes_W.transpose();
  const ContactBody& a = problem.bodies[contact.body_a];
  const ContactBody& b = problem.bodies[contact.body_b];
  block.free = axes_W.transpose() * (b.free_w_W - a.free_w_W);
  for (Eigen::Index k = 0; k < 3; ++k) {
    block.lambda[k] = component(axes_W.col(k), contact.angular_impulse_W);
  }
  block.lambda = project(block, block.lambda, blocks_[owner].lambda[0]);
  finish(at, axes_W, index);
}

std::pair<Vector3, Vector3> ContactSystem::body_velocity(const ContactProblem& problem,
                                                         std::size_t index) const {
  const ContactBody& body = problem.bodies[index];
  const int slot = slot_of_body_[index];
  if (slot < 0) return {body.free_v_W, body.free_w_W};
  const Vector6& y = y_[std::size_t(slot)];
  const Slot& roots = slots_[std::size_t(slot)];
  return {body.free_v_W + roots.S_v * y.head<3>(), body.free_w_W + roots.S_w * y.tail<3>()};
}

void ContactSystem::update_friction(const ContactProblem& problem) {
  if (!problem.friction_law) return;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    Block& block = blocks_[i];
    if (block.kind != BlockKind::Contact) continue;
    const PointContact& contact = problem.contacts[sources_[i].index];
    const auto [v_a_W, w_a_W] = body_velocity(problem, contact.body_a);
    const auto [v_b_W, w_b_W] = body_velocity(problem, contact.body_b);
    const Vector3 u_W = v_b_W - v_a_W + w_b_W.cross(contact.r_b_W) - w_a_W.cross(contact.r_a_W) -
                        contact.sticking_velocity_W;
    const Vector3 n = contact.nhat_AB_W.normalized();
    const Vector3 sliding_W = u_W - n * n.dot(u_W);
    const Scalar friction = problem.friction_law(sources_[i].index, sliding_W);
    check_friction(friction, sources_[i].index);
    block.friction = friction;
  }
}

bool ContactSystem::has_turning() const {
  return std::any_of(blocks_.begin(), blocks_.end(),
                     [](const Block& block) { return block.owner >= 0; });
}

void ContactSystem::update_velocities() {
  for (Vector6& y : y_) y.setZero();
  add_impulses(y_, [&](std::size_t i) { return blocks_[i].lambda; });
}

Scalar ContactSystem::residual(const Block& block) const {
  DYOP_ASSERT(block.owner < int(blocks_.size()), block.owner);
  Vector3 u = relative_velocity(block);
  if (block.kind == BlockKind::Contact) u[0] += block.friction * tangent_length(u);
  const Scalar normal = block.owner >= 0 ? blocks_[std::size_t(block.owner)].lambda[0] : 0;
  const Scalar rho = 1 / block.weight;
  const Vector3& lambda = block.lambda;
  const Vector3 x(lambda[0] - rho * u[0], lambda[1] - rho * u[1], lambda[2] - rho * u[2]);
  const Scalar away = (lambda - project(block, x, normal)).norm();
  return (away + kResidualNoise * lambda.norm()) * block.weight;
}

Scalar ContactSystem::residual() const {
  return loops_.largest(blocks_.size(), [&](std::size_t i) { return residual(blocks_[i]); });
}

Scalar ContactSystem::residual_without_impulses() const {
  Scalar largest = 0;
  for (const Block& block : blocks_) {
    const bool may_push = block.kind != BlockKind::Row || block.upper > 0;
    const bool may_pull = block.kind == BlockKind::Row && block.lower < 0;
    const Scalar u = block.free[0];
    if (u < 0 ? may_push : may_pull) largest = std::max(largest, std::abs(u));
  }
  return largest;
}

int ContactSystem::immovable_violations(Scalar tolerance) const {
  int count = 0;
  for (const Block& block : immovable_) {
    const Scalar u = block.free[0];
    const bool is_free = block.kind == BlockKind::Row && block.lower == 0 && block.upper == 0;
    const bool may_separate = block.kind == BlockKind::Contact || !(block.lower < 0);
    const bool may_approach = block.kind == BlockKind::Row && !(block.upper > 0);
    if (block.owner >= 0 || is_free) continue;
    count += (u < -tolerance && !may_approach) || (u > tolerance && !may_separate);
  }
  return count;
}

void ContactSystem::write(ContactProblem& problem) const {
  loops_.each(problem.bodies.size(), [&](std::size_t i) {
    std::tie(problem.bodies[i].v_W, problem.bodies[i].w_W) = body_velocity(problem, i);
  });
  for (PointContact& contact : problem.contacts) {
    contact.impulse_W.setZero();
    contact.angular_impulse_W.setZero();
  }
  for (JointRow& row : problem.rows) row.impulse = 0;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    const std::size_t index = sources_[i].index;
    const Vector3 impulse_W = sources_[i].basis_W * blocks_[i].lambda;
    switch (blocks_[i].kind) {
      case BlockKind::Contact:
        problem.contacts[index].impulse_W = impulse_W;
        break;
      case BlockKind::Row:
        problem.rows[index].impulse = blocks_[i].lambda[0];
        break;
      case BlockKind::Rolling:
      case BlockKind::Torsion:
        problem.contacts[index].angular_impulse_W += impulse_W;
        break;
    }
  }
}

}  // namespace dyop::contact_internal
