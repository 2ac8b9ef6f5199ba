// SPDX-License-Identifier: BSD-3-Clause
#include "contact/solver/contact_restart.h"

#include <array>

#include "contact/solver/contact_law.h"

namespace dyop::contact_internal {
namespace {

// Sizes of the starts one after the other; with one size alone fewer problems are solved.
constexpr std::array<Scalar, 3> kSizes{1, 0.2, 5};

// In [-1, 1], by the same arithmetic with every standard library.
Scalar signed_fraction(std::minstd_rand& random) {
  return 2 * Scalar(random()) / Scalar(std::minstd_rand::max()) - 1;
}

}  // namespace

void ContactRestart::begin(const ContactSystem& system) {
  friction_.clear();
  for (const Block& block : system.blocks()) friction_.push_back(block.friction);
  random_.seed();
  starts_ = 0;
}

void ContactRestart::set_friction(ContactSystem& system, Scalar fraction) const {
  for (std::size_t i = 0; i < friction_.size(); ++i) {
    Block& block = system.blocks()[i];
    block.friction = fraction * friction_[i];
    if (fraction == 0) block.lambda.setZero();
  }
  system.update_velocities();
}

void ContactRestart::scatter(ContactSystem& system) {
  set_friction(system, 1);
  const Scalar speed = kSizes[starts_++ % kSizes.size()] * system.residual_without_impulses();
  for (Block& block : system.blocks()) {
    const Scalar size = speed / block.weight;
    Vector3 impulse;
    for (Scalar& component : impulse) component = size * signed_fraction(random_);
    const bool is_turning = block.kind == BlockKind::Rolling || block.kind == BlockKind::Torsion;
    const Scalar bound =
        is_turning ? system.blocks()[std::size_t(block.owner)].lambda[0] : Scalar{0};
    block.lambda = project(block, impulse, bound);
  }
  system.update_velocities();
}

}  // namespace dyop::contact_internal
