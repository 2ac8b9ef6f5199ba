// SPDX-License-Identifier: BSD-3-Clause
#include "contact/solver/contact_sweeps.h"

#include <algorithm>
#include <utility>

#include "core/tolerance.h"

namespace dyop::contact_internal {

extern const SweepKernels sweep_kernels_baseline;
#ifdef DYOP_HAS_X86_KERNELS
extern const SweepKernels sweep_kernels_avx2;
extern const SweepKernels sweep_kernels_avx512;
#endif

const SweepKernels& sweep_kernels(InstructionSet set) {
#ifdef DYOP_HAS_X86_KERNELS
  if (set == InstructionSet::Avx512) return sweep_kernels_avx512;
  if (set == InstructionSet::Avx2) return sweep_kernels_avx2;
#endif
  (void)set;
  return sweep_kernels_baseline;
}

namespace {

constexpr std::size_t kWidth = kSweepWidth;
// Contacts per group from which groups are faster than one contact after the other.
constexpr std::size_t kLeastFill = 2;

SweepGroup empty_group(int no_body) {
  SweepGroup group{};
  for (std::size_t w = 0; w < kWidth; ++w) {
    group.weight[w] = 1;
    group.body_a[w] = group.body_b[w] = no_body;
  }
  return group;
}

void put_rows(const Rows6& G, double (&rows)[18][kSweepWidth], std::size_t lane) {
  for (std::size_t i = 0; i < 18; ++i) rows[i][lane] = G.data()[i];
}

}  // namespace

bool ContactSweeps::begin(const ContactSystem& system) {
  const std::vector<Block>& blocks = system.blocks();
  const bool has_others = std::any_of(blocks.begin(), blocks.end(), [](const Block& block) {
    return block.kind != BlockKind::Contact || block.carriers > 0;
  });
  if (has_others || blocks.size() < kLeastFill) return false;
  const std::size_t bodies = system.velocities().size();
  next_group_.assign(bodies, 0);
  counts_.clear();
  with_room_.clear();
  places_.clear();
  for (const Block& block : blocks) places_.push_back(find_place(block));
  if (kLeastFill * counts_.size() > blocks.size()) return false;
  groups_.assign(counts_.size(), empty_group(int(6 * bodies)));
  for (std::size_t i = 0; i < blocks.size(); ++i) put(blocks[i], places_[i]);
  y_.assign(6 * (bodies + 1), 0);
  for (std::size_t i = 0; i < bodies; ++i) {
    std::copy_n(system.velocities()[i].data(), 6, y_.data() + 6 * i);
  }
  old_y_ = y_;
  step_y_.assign(y_.size(), 0);
  old_change_sq_ = 0;
  return true;
}

// The first group from `first` on that has room; makes one if there is none.
int ContactSweeps::group_with_room(int first) {
  int group = first;
  while (group < int(counts_.size()) && with_room_[std::size_t(group)] != group) {
    group = with_room_[std::size_t(group)];
  }
  while (first != group) {  // the way is shorter the next time
    first = std::exchange(with_room_[std::size_t(first)], group);
  }
  if (group == int(counts_.size())) {
    counts_.push_back(0);
    with_room_.push_back(group);
  }
  return group;
}

// After all groups with contacts before it of the same bodies.
ContactSweeps::Place ContactSweeps::find_place(const Block& block) {
  int first = 0;
  for (const int slot : {block.slot_a, block.slot_b}) {
    if (slot >= 0) first = std::max(first, next_group_[std::size_t(slot)]);
  }
  const int group = group_with_room(first);
  const int lane = counts_[std::size_t(group)]++;
  if (lane + 1 == kSweepWidth) with_room_[std::size_t(group)] = group + 1;
  for (const int slot : {block.slot_a, block.slot_b}) {
    if (slot >= 0) next_group_[std::size_t(slot)] = group + 1;
  }
  return {group, lane};
}

void ContactSweeps::put(const Block& block, const Place& place) {
  SweepGroup& group = groups_[std::size_t(place.group)];
  const std::size_t lane = std::size_t(place.lane);
  put_rows(block.G_a, group.G_a, lane);
  put_rows(block.G_b, group.G_b, lane);
  if (block.slot_a >= 0) group.body_a[lane] = 6 * block.slot_a;
  if (block.slot_b >= 0) group.body_b[lane] = 6 * block.slot_b;
  for (Eigen::Index i = 0; i < 3; ++i) {
    group.free[i][lane] = block.free[i];
    group.lambda[i][lane] = block.lambda[i];
    for (Eigen::Index k = 0; k <= i; ++k) group.W[i * (i + 1) / 2 + k][lane] = block.W(i, k);
  }
  group.friction[lane] = block.friction;
  group.weight[lane] = block.weight;
  group.slip[lane] = block.slip;
  const LocalContact& local = block.local;
  group.normal_inverse[lane] = local.normal_inverse();
  group.tangential[lane] = local.tangential();
  group.tangential_inverse[lane] = 1 / local.tangential();
  group.noise[lane] = kContactMobilityNoise * block.W.trace();
  group.is_coupled[lane] = local.is_uncoupled() ? 0 : 1;
  group.has_coupled = group.has_coupled || !local.is_uncoupled();
}

Scalar ContactSweeps::sweep() {
  old_y_ = y_;
  return kernels_->sweep(groups_.data(), int(groups_.size()), y_.data());
}

Scalar ContactSweeps::residual() const {
  return kernels_->residual(groups_.data(), int(groups_.size()), y_.data());
}

// Sum of weight times the squared change of the impulses in the last sweep.
Scalar ContactSweeps::change_sq() const {
  Scalar sum[kWidth] = {};
  for (const SweepGroup& group : groups_) {
    for (std::size_t w = 0; w < kWidth; ++w) {
      const Scalar x = group.lambda[0][w] - group.before[0][w];
      const Scalar y = group.lambda[1][w] - group.before[1][w];
      const Scalar z = group.lambda[2][w] - group.before[2][w];
      sum[w] += group.weight[w] * (x * x + y * y + z * z);
    }
  }
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

// The change over a sweep acts as the gradient in a nonlinear conjugate gradient iteration
// (Fletcher-Reeves); when it grows, the direction is dropped.
void ContactSweeps::accelerate() {
  const Scalar change = change_sq();
  const Scalar beta = old_change_sq_ > 0 ? change / old_change_sq_ : 0;
  old_change_sq_ = change;
  const bool is_restart = !(beta <= 1);
  const auto advance = [&](double* value, const double* before, double* step, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      const double along = is_restart ? 0 : beta * step[i];
      step[i] = is_restart ? 0 : along + (value[i] - before[i]);
      value[i] += along;
    }
  };
  for (SweepGroup& group : groups_) {
    advance(group.lambda[0], group.before[0], group.step[0], 3 * kWidth);
  }
  advance(y_.data(), old_y_.data(), step_y_.data(), y_.size());
}

void ContactSweeps::write(ContactSystem& system) const {
  std::vector<Block>& blocks = system.blocks();
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const SweepGroup& group = groups_[std::size_t(places_[i].group)];
    const std::size_t lane = std::size_t(places_[i].lane);
    blocks[i].lambda = {group.lambda[0][lane], group.lambda[1][lane], group.lambda[2][lane]};
    blocks[i].slip = group.slip[lane];
  }
  for (std::size_t i = 0; i < system.velocities().size(); ++i) {
    std::copy_n(y_.data() + 6 * i, 6, system.velocities()[i].data());
  }
}

}  // namespace dyop::contact_internal
