// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "contact/solver/contact_law.h"
#include "contact/solver/shared_loops.h"
#include "core/assert.h"
#include "dyop/contact/contact_problem.h"
#include "dyop/contact/contact_solver.h"
#include "dyop/core/types.h"

namespace dyop::contact_internal {

// Throw InvalidArgument, naming the value, for input that contact_problem.h and contact_solver.h do
// not allow.
void check_problem(const ContactProblem& problem, const SharedLoops& loops);
void check_friction(Scalar friction, std::size_t contact);

inline std::span<const Carried> carried_by(const Block& block) {
  return {block.carried, std::size_t(block.carriers)};
}

/// G y: a block's relative velocity, or its change, without what is free and compliance. One row, of
/// a joint or torsion, takes a third of the time.
inline Vector3 velocity_of(const Block& block, const std::vector<Vector6>& y) {
  Vector3 u = Vector3::Zero();
  if (block.kind == BlockKind::Row || block.kind == BlockKind::Torsion) {
    if (block.slot_a >= 0) u[0] += block.G_a.row(0).dot(y[std::size_t(block.slot_a)]);
    if (block.slot_b >= 0) u[0] += block.G_b.row(0).dot(y[std::size_t(block.slot_b)]);
    return u;
  }
  if (block.slot_a >= 0) u += block.G_a * y[std::size_t(block.slot_a)];
  if (block.slot_b >= 0) u += block.G_b * y[std::size_t(block.slot_b)];
  for (const Carried& more : carried_by(block)) u += more.G * y[std::size_t(more.slot)];
  return u;
}

/// y += G^T lambda, for one of a block's bodies.
inline void add_impulse(BlockKind kind, const Rows6& G, const Vector3& lambda, Vector6& y) {
  if (kind == BlockKind::Row || kind == BlockKind::Torsion) {
    y += lambda[0] * G.row(0).transpose();
  } else {
    y += G.transpose() * lambda;
  }
}

/// y += G^T lambda.
inline void add_impulse(const Block& block, const Vector3& lambda, std::vector<Vector6>& y) {
  const auto add = [&](int slot, const Rows6& G) {
    if (slot >= 0) add_impulse(block.kind, G, lambda, y[std::size_t(slot)]);
  };
  add(block.slot_a, block.G_a);
  add(block.slot_b, block.G_b);
  for (const Carried& more : carried_by(block)) add(more.slot, more.G);
}

/// Whether an iteration still gets on: it halves its residual within so many steps as its patience.
class Progress {
 public:
  Progress(Scalar residual, int patience) : at_mark_(residual), patience_(patience) {}

  /// After `done` steps in all, with the least residual so far.
  bool has_stalled(int done, Scalar residual) {
    if (done - mark_ < patience_) return false;
    if (!(residual <= at_mark_ / 2)) return true;
    mark_ = done;
    at_mark_ = residual;
    return false;
  }

 private:
  Scalar at_mark_;
  int mark_ = 0;
  int patience_;
};

// A contact problem in the coordinates of Block. Blocks: first the joints' rows, then
// every contact, each followed by its rolling and torsional blocks. Blocks that no impulse can
// change are kept separately.
class ContactSystem {
 public:
  // A block of a body, which of the block's two the body is, and a copy of its rows.
  struct Share {
    std::size_t block = 0;
    bool is_a = true;
    Rows6 G;
  };

  // The threads for problems without carriers, until told otherwise; null: none but the caller's.
  void set_team(core_internal::Team* team) { loops_.set_team(team); }
  const SharedLoops& loops() const { return loops_; }

  // Checks and converts; impulses are carried over, each projected into its admissible set.
  void build(const ContactProblem& problem);

  // Evaluates the friction law, if any, at the present velocities.
  void update_friction(const ContactProblem& problem);

  std::vector<Block>& blocks() { return blocks_; }
  const std::vector<Block>& blocks() const { return blocks_; }
  // Or only the rows of joints.
  bool has_contacts() const { return !blocks_.empty() && blocks_.back().kind != BlockKind::Row; }
  // Rolling or torsional friction.
  bool has_turning() const;
  std::vector<Vector6>& velocities() { return y_; }  // y, one per movable body
  const std::vector<Vector6>& velocities() const { return y_; }

  // Recomputes y = sum of G^T lambda.
  void update_velocities();

  // y += sum of G^T impulse(i) over the blocks i, for each body in their order. With a team,
  // impulse(i) is called once for each of the block's bodies.
  template <typename Impulse>
  void add_impulses(std::vector<Vector6>& y, const Impulse& impulse) const;

  // The blocks of a body, in their order. Only with a team.
  std::span<const Share> shares_of(std::size_t slot) const {
    return {shares_.data() + first_share_[slot], shares_.data() + first_share_[slot + 1]};
  }

  // u of one block, with compliance. Inline, as sweeps spend most of their time here.
  Vector3 relative_velocity(const Block& block) const;

  // The residual of ContactReport at the present impulses and velocities.
  Scalar residual() const;
  Scalar residual(const Block& block) const;

  // Largest relative velocity that an impulse has to change: the residual of starting from nothing.
  Scalar residual_without_impulses() const;

  // Number of blocks without mobility whose law is violated by more than the tolerance.
  int immovable_violations(Scalar tolerance) const;

  // Impulses and velocities, in the problem's terms.
  void write(ContactProblem& problem) const;

 private:
  struct Source {  // the contact or row of a block
    std::size_t index = 0;
    Matrix3 basis_W = Matrix3::Identity();  // columns: lambda's components as impulses
  };
  struct Slot {
    Matrix3 S_v, S_w;  // S S^T = mobility
  };

  // (v, w) of a body at the present y.
  std::pair<Vector3, Vector3> body_velocity(const ContactProblem& problem, std::size_t index) const;
  void build_slots(const ContactProblem& problem);
  void place_blocks(const ContactProblem& problem);
  void make_row(const ContactProblem& problem, std::size_t index);
  void make_contact(const ContactProblem& problem, std::size_t index);
  void make_turning(const ContactProblem& problem, std::size_t index, const Matrix3& basis_W,
                    BlockKind kind, std::size_t owner, std::size_t at);
  void begin_block(Block& block, BlockKind kind, std::size_t body_a, std::size_t body_b) const;
  void add_carriers(const ContactProblem& problem, std::size_t index, const Matrix3& basis_W,
                    Block& block);
  void to_slot(int slot, Rows6& G) const;
  void finish(std::size_t at, const Matrix3& basis_W, std::size_t index);
  void set_immovable_apart();
  void list_shares();

  SharedLoops loops_;
  std::vector<Block> blocks_;
  std::vector<Source> sources_;
  bool has_immovable_ = false;                 // among the blocks, until they are set apart
  std::vector<std::size_t> place_of_contact_;  // its block, until immovable ones are set apart
  std::vector<std::size_t> first_share_;       // by body, into the shares
  std::vector<Share> shares_;
  std::vector<Block> immovable_;
  std::vector<Carried> carried_;
  std::size_t next_carrier_ = 0;  // of the problem
  std::vector<Slot> slots_;
  std::vector<int> slot_of_body_;
  std::vector<Vector6> y_;
};

template <typename Impulse>
void ContactSystem::add_impulses(std::vector<Vector6>& y, const Impulse& impulse) const {
  if (!loops_.has_team()) {
    for (std::size_t i = 0; i < blocks_.size(); ++i) add_impulse(blocks_[i], impulse(i), y);
    return;
  }
  loops_.each(y.size(), [&](std::size_t slot) {
    for (const Share& share : shares_of(slot)) {
      add_impulse(blocks_[share.block].kind, share.G, impulse(share.block), y[slot]);
    }
  });
}

inline Vector3 ContactSystem::relative_velocity(const Block& block) const {
  DYOP_ASSERT(block.slot_a < int(y_.size()) && block.slot_b < int(y_.size()), block.slot_a, ' ',
              block.slot_b);
  Vector3 u = block.free + velocity_of(block, y_);
  u[0] += block.compliance * block.lambda[0];
  return u;
}

}  // namespace dyop::contact_internal
