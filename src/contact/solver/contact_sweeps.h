// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact/solver/contact_system.h"
#include "contact/solver/sweep_kernels.h"

namespace dyop::contact_internal {

// Sweeps over a system of contacts alone, several at once. Contacts that share a body stay in
// their order, so that a sweep does the same as one contact after the other.
class ContactSweeps {
 public:
  explicit ContactSweeps(InstructionSet set = best_instruction_set())
      : kernels_(&sweep_kernels(set)) {}

  // Takes over a system's impulses and velocities. Returns false if it is not worth it: few of its
  // contacts are apart from each other, or it has other blocks or carriers.
  bool begin(const ContactSystem& system);

  // Forward and back; returns the largest change of a velocity.
  Scalar sweep();
  // Goes on along the conjugate direction of the last sweep.
  void accelerate();
  // ContactSystem::residual().
  Scalar residual() const;
  void write(ContactSystem& system) const;

 private:
  struct Place {
    int group = 0;
    int lane = 0;
  };

  Place find_place(const Block& block);
  int group_with_room(int first);
  void put(const Block& block, const Place& place);
  Scalar change_sq() const;

  const SweepKernels* kernels_;
  std::vector<SweepGroup> groups_;
  std::vector<int> counts_;      // of contacts, by group
  std::vector<int> with_room_;   // by group: itself if it has room, or a later one to ask
  std::vector<int> next_group_;  // by body: the first one that it may be in
  std::vector<Place> places_;    // by block
  std::vector<double> y_, old_y_, step_y_;  // six numbers a body, then six that nobody reads
  Scalar old_change_sq_ = 0;
};

}  // namespace dyop::contact_internal
