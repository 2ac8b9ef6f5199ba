// SPDX-License-Identifier: BSD-3-Clause
#include "contact/solver/contact_system.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "contact/solver/contact_law.h"
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
  check_problem(problem);
  blocks_.clear();
  sources_.clear();
  immovable_.clear();
  carried_.clear();
  carried_.reserve(problem.carriers.size());  // blocks point into it
  next_carrier_ = 0;
  build_slots(problem);
  for (std::size_t i = 0; i < problem.rows.size(); ++i) add_row(problem, i);
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) add_contact(problem, i);
  update_velocities();
}

void ContactSystem::build_slots(const ContactProblem& problem) {
  slots_.clear();
  slot_of_body_.clear();
  for (std::size_t i = 0; i < problem.bodies.size(); ++i) {
    const ContactBody& body = problem.bodies[i];
    if (body.inverse_mass_W.isZero(0) && body.inverse_inertia_W.isZero(0)) {
      slot_of_body_.push_back(-1);
      continue;
    }
    slot_of_body_.push_back(int(slots_.size()));
    slots_.push_back({square_root(body.inverse_mass_W), square_root(body.inverse_inertia_W)});
  }
  y_.assign(slots_.size(), Vector6::Zero());
}

Block ContactSystem::make_block(BlockKind kind, std::size_t body_a, std::size_t body_b) const {
  DYOP_ASSERT(body_a < slot_of_body_.size() && body_b < slot_of_body_.size(), body_a, ' ', body_b);
  Block block;
  block.kind = kind;
  block.slot_a = slot_of_body_[body_a];
  block.slot_b = slot_of_body_[body_b];
  return block;
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

// Stores the block unless no impulse changes its first component. Returns whether it was stored.
bool ContactSystem::finish(Block& block, const Matrix3& basis_W, std::size_t index) {
  to_slot(block.slot_a, block.G_a);
  to_slot(block.slot_b, block.G_b);
  block.W.noalias() = block.G_a * block.G_a.transpose();
  block.W.noalias() += block.G_b * block.G_b.transpose();
  for (const Carried& more : carried_by(block)) block.W.noalias() += more.G * more.G.transpose();
  block.weight = block.W.trace() + block.compliance;
  if (!(block.W(0, 0) + block.compliance > kContactMobilityNoise * block.weight)) {
    block.lambda.setZero();
    immovable_.push_back(block);
    return false;
  }
  if (block.kind == BlockKind::Contact) block.local = LocalContact(block.W);
  blocks_.push_back(block);
  sources_.push_back({index, basis_W});
  return true;
}

void ContactSystem::add_row(const ContactProblem& problem, std::size_t index) {
  const JointRow& row = problem.rows[index];
  const ContactBody& a = problem.bodies[row.body_a];
  const ContactBody& b = problem.bodies[row.body_b];
  Block block = make_block(BlockKind::Row, row.body_a, row.body_b);
  block.G_a.row(0) << row.j_av_W.transpose(), row.j_aw_W.transpose();
  block.G_b.row(0) << row.j_bv_W.transpose(), row.j_bw_W.transpose();
  block.free[0] = row.j_av_W.dot(a.free_v_W) + row.j_aw_W.dot(a.free_w_W) +
                  row.j_bv_W.dot(b.free_v_W) + row.j_bw_W.dot(b.free_w_W) - row.target;
  block.compliance = row.compliance;
  block.lower = row.lower;
  block.upper = row.upper;
  block.lambda[0] = std::clamp(row.impulse, row.lower, row.upper);
  finish(block, Matrix3::Identity(), index);
}

void ContactSystem::add_contact(const ContactProblem& problem, std::size_t index) {
  const PointContact& contact = problem.contacts[index];
  const ContactBody& a = problem.bodies[contact.body_a];
  const ContactBody& b = problem.bodies[contact.body_b];
  const Matrix3 basis_W = make_basis(contact);
  Block block = make_block(BlockKind::Contact, contact.body_a, contact.body_b);
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
  add_carriers(problem, index, basis_W, block);
  block.friction = largest_coefficient(contact);
  block.lambda[0] = std::max(block.lambda[0], Scalar{0});  // contacts cannot pull
  const Scalar bound = block.friction * block.lambda[0];
  const Scalar length = block.lambda.tail<2>().norm();
  if (length > bound) block.lambda.tail<2>() *= bound / length;
  if (!finish(block, basis_W, index)) return;
  const int owner = int(blocks_.size()) - 1;
  if (contact.rolling_friction > 0) {
    add_turning(problem, index, basis_W, BlockKind::Rolling, owner);
  }
  if (contact.torsional_friction > 0) {
    add_turning(problem, index, basis_W, BlockKind::Torsion, owner);
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

void ContactSystem::add_turning(const ContactProblem& problem, std::size_t index,
                                const Matrix3& basis_W, BlockKind kind, int owner) {
  const PointContact& contact = problem.contacts[index];
  Matrix3 axes_W = Matrix3::Zero();
  if (kind == BlockKind::Rolling) {
    axes_W.col(0) = basis_W.col(0).unitOrthogonal() * contact.rolling_friction;
    axes_W.col(1) = basis_W.col(0).cross(axes_W.col(0));
  } else {
    axes_W.col(0) = basis_W.col(0) * contact.torsional_friction;
  }
  Block block = make_block(kind, contact.body_a, contact.body_b);
  block.owner = owner;
  block.G_a.rightCols<3>() = -axes_W.transpose();
  block.G_b.rightCols<3>() = axes_W.transpose();
  const ContactBody& a = problem.bodies[contact.body_a];
  const ContactBody& b = problem.bodies[contact.body_b];
  block.free = axes_W.transpose() * (b.free_w_W - a.free_w_W);
  for (Eigen::Index k = 0; k < 3; ++k) {
    block.lambda[k] = component(axes_W.col(k), contact.angular_impulse_W);
  }
  block.lambda = project(block, block.lambda, blocks_[std::size_t(owner)].lambda[0]);
  finish(block, axes_W, index);
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

void ContactSystem::update_velocities() {
  for (Vector6& y : y_) y.setZero();
  for (const Block& block : blocks_) add_impulse(block, block.lambda, y_);
}

Scalar ContactSystem::residual(const Block& block) const {
  DYOP_ASSERT(block.owner < int(blocks_.size()), block.owner);
  Vector3 u = relative_velocity(block);
  if (block.kind == BlockKind::Contact) u[0] += block.friction * tangent_length(u);
  const Scalar normal = block.owner >= 0 ? blocks_[std::size_t(block.owner)].lambda[0] : 0;
  const Scalar rho = 1 / block.weight;
  const Vector3& lambda = block.lambda;
  const Vector3 x(lambda[0] - rho * u[0], lambda[1] - rho * u[1], lambda[2] - rho * u[2]);
  return (lambda - project(block, x, normal)).norm() * block.weight;
}

Scalar ContactSystem::residual() const {
  Scalar largest = 0;
  for (const Block& block : blocks_) {
    const Scalar r = residual(block);
    if (!(r <= largest)) largest = r;  // NaN is kept
  }
  return largest;
}

Scalar ContactSystem::residual_without_impulses() const {
  Scalar largest = 0;
  for (const Block& block : blocks_) {
    largest = std::max(largest, block.kind == BlockKind::Row ? std::abs(block.free[0])
                                                             : std::max(-block.free[0], Scalar{0}));
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
  for (std::size_t i = 0; i < problem.bodies.size(); ++i) {
    std::tie(problem.bodies[i].v_W, problem.bodies[i].w_W) = body_velocity(problem, i);
  }
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
